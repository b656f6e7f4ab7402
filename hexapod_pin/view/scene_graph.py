"""What a viewer is told to draw: the robot, the ground, force arrows, and how they move.

The output is meshcat's command language as plain data (dicts of numbers and text), the same for a
file and for a live viewer. Lengths in metres, world axes, quaternions x y z w.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.errors import ParameterError, ViewerError
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.ground_mesh import (
    ground_mesh,
    is_level,
    patch_outlines,
    profile_edges,
    shaking,
    terrain_of,
)
from hexapod_pin.view.robot_shapes import Y_TO_Z, RobotShapes, Shape, box, cylinder

Array = npt.NDArray[np.float64]
Command = dict[str, Any]

ROOT = "/meshcat"
DIGITS = 6  # micrometres and microradians
HIDDEN = 1e-6  # scale of an arrow without force; 0 would have no inverse
FOREVER = 10**9  # repetitions of a looped animation
ARROW_COLOR = (0.9, 0.15, 0.1, 0.9)
GROUND_COLOR = (0.86, 0.87, 0.85, 1.0)
LINE_COLOR = (0.6, 0.62, 0.6, 1.0)
EDGE_COLOR = (0.42, 0.43, 0.42, 1.0)
PATCH_COLOR = (0.2, 0.4, 0.8, 1.0)
SKY = ((0.80, 0.88, 0.95), (0.97, 0.98, 1.0))  # top, bottom


@dataclass(frozen=True)
class Sizes:
    """Lengths that fit the picture to the robot."""

    reach: float  # trunk to farthest foot at the start, horizontally [m]
    ground: float  # height of the ground's top [m]
    force_scale: float  # arrow length per force [m/N]

    @classmethod
    def of(cls, trace: Trace, force_scale: float | None) -> Sizes:
        """Measure a trace; by default an arrow of the robot's weight is 1.5 reaches long."""
        radii = np.asarray(trace.meta.get("foot_radius") or np.zeros(len(trace.foot_names)))
        ground, reach = 0.0, 0.3
        if trace.foot_names:
            away = trace.foot_position[0, :, :2] - trace.q[0, :2]
            reach = max(0.05, float(np.max(np.linalg.norm(away, axis=1))))
            ground = float(np.mean(trace.foot_position[0, :, 2] - radii - trace.foot_gap[0]))
        if force_scale is None:
            force_scale = 1.5 * reach / _weight(trace)
        elif not (math.isfinite(force_scale) and force_scale > 0.0):
            raise ParameterError("force_scale", force_scale, "positive and finite [m/N]")
        return cls(reach, ground, force_scale)


def _weight(trace: Trace) -> float:
    """Return the robot's weight, or where it has none the largest foot force, or 1 [N]."""
    gravity = float(np.linalg.norm(trace.meta.get("gravity", (0.0, 0.0, -9.81))))
    weight = float(trace.meta.get("total_mass", 0.0)) * gravity
    return weight or float(np.max(np.linalg.norm(trace.foot_force, axis=-1), initial=0.0)) or 1.0


def scene_commands(trace: Trace, *, force_scale: float | None = None) -> list[Command]:
    """Return the commands that set up the still picture.

    Args:
        trace: what to show.
        force_scale: arrow length per force [m/N]; None fits it to the robot's weight.

    Raises:
        ViewerError: the trace's URDF cannot be drawn.
        ParameterError: `force_scale` is not positive.
    """
    sizes = Sizes.of(trace, force_scale)
    commands = [
        _property("/Grid", "visible", False),
        _property("/Axes", "visible", False),
        _property("/Background", "top_color", list(SKY[0])),
        _property("/Background", "bottom_color", list(SKY[1])),
        _camera(sizes.reach),
    ]
    for body, shapes in _robot(trace).bodies.items():
        for k, shape in enumerate(shapes):
            commands.append(_object(f"{_body_path(body)}/{k}", shape))
    for foot in trace.foot_names:
        commands += _arrow(_arrow_path(foot), 0.02 * sizes.reach)
    return [*commands, *_ground(trace, sizes)]


def animation_command(
    trace: Trace,
    *,
    fps: float = 30.0,
    force_scale: float | None = None,
    speed: float = 1.0,
    loop: bool = True,
) -> Command:
    """Return the command that moves the picture; the camera follows the trunk horizontally.

    Args:
        trace: what to show.
        fps: pictures per simulated second; the nearest samples are used, never more than there are.
        force_scale: arrow length per force [m/N]; None fits it to the robot's weight.
        speed: simulated time over wall-clock time.
        loop: whether to start again at the end.

    Raises:
        ViewerError: a sample is not finite, or the trace's URDF cannot be drawn.
        ParameterError: `fps`, `speed` or `force_scale` is not positive.
    """
    for name, value in (("fps", fps), ("speed", speed)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(name, value, "positive and finite")
    index = frame_samples(trace, fps)
    _require_finite(trace, index)
    times = np.round((trace.time[index] - trace.time[0]) / speed, DIGITS)
    if len(index) == 1:
        index, times = np.repeat(index, 2), np.array([0.0, 1.0 / fps])
    motion = _motion(trace, index, Sizes.of(trace, force_scale))
    clips = [_clip(path, times, tracks) for path, tracks in motion.items()]
    options = {"play": True, "repetitions": FOREVER if loop else 1}
    return {"type": "set_animation", "path": "", "animations": clips, "options": options}


def frame_samples(trace: Trace, fps: float) -> npt.NDArray[np.intp]:
    """Return the indices of the samples nearest to the picture times, each once."""
    time = trace.time
    wanted = np.arange(time[0], time[-1] + 0.5 / fps, 1.0 / fps)
    right = np.clip(np.searchsorted(time, wanted), 1, max(len(time) - 1, 1))
    left = right - 1
    if len(time) == 1:
        return np.zeros(1, dtype=np.intp)
    nearest = np.where(wanted - time[left] <= time[right] - wanted, left, right)
    return np.unique(nearest)


def _require_finite(trace: Trace, index: npt.NDArray[np.intp]) -> None:
    """Refuse samples that a viewer cannot draw."""
    for name in ("q", "foot_position", "foot_force"):
        values = getattr(trace, name)[index]
        good = np.isfinite(values).reshape(len(index), -1).all(axis=1)
        if not good.all():
            sample = int(index[np.argmin(good)])
            raise ViewerError(
                f"{name} is not finite in sample {sample} (t = {trace.time[sample]:g} s); "
                "it cannot be drawn."
            )


def _motion(trace: Trace, index: npt.NDArray[np.intp], sizes: Sizes) -> dict[str, dict[str, Array]]:
    """Return the tracks (K, 3 or 4) of everything that moves, by path."""
    q = trace.q[index]
    focus = -np.column_stack([q[:, 0], q[:, 1], np.full(len(index), q[0, 2])])
    motion = {ROOT: {"position": focus}}
    lift = shaking(terrain_of(trace), trace.time[index])
    if lift is not None:
        motion[f"{ROOT}/ground"] = {"position": lift[:, None] * (0.0, 0.0, 1.0)}
    for body, (position, attitude) in _robot(trace).poses(q, trace.joint_names).items():
        motion[_body_path(body)] = {"position": position, "quaternion": attitude}
    radii = trace.meta.get("foot_radius") or [0.0] * len(trace.foot_names)
    for f, foot in enumerate(trace.foot_names):
        contact = trace.foot_position[index, f] - radii[f] * trace.foot_normal[index, f]
        arrow = _arrow_tracks(trace.foot_force[index, f] * sizes.force_scale)
        motion[_arrow_path(foot)] = {"position": contact, **arrow}
    return motion


def _arrow_tracks(vector: Array) -> dict[str, Array]:
    """Return attitude and scale of a unit arrow along z that is to show `vector` (K, 3) [m]."""
    length = np.linalg.norm(vector, axis=1)
    shown = length > 1e-4
    unit = np.where(shown[:, None], vector, (0.0, 0.0, 1.0))
    unit = unit / np.linalg.norm(unit, axis=1, keepdims=True)
    turn = np.column_stack([-unit[:, 1], unit[:, 0], np.zeros(len(unit)), 1.0 + unit[:, 2]])
    turn[unit[:, 2] < -1.0 + 1e-9] = (1.0, 0.0, 0.0, 0.0)
    scale = np.where(shown[:, None], np.column_stack([shown, shown, length]), HIDDEN)
    return {"quaternion": turn / np.linalg.norm(turn, axis=1, keepdims=True), "scale": scale}


def _clip(path: str, times: Array, tracks: Mapping[str, Array]) -> Command:
    """Return one object's animation; three.js takes times in seconds and values in a row."""
    kinds = {"quaternion": "quaternion"}
    rows = [
        {
            "name": f".{name}",
            "type": kinds.get(name, "vector3"),
            "times": times.tolist(),
            "values": np.round(values, DIGITS).ravel().tolist(),
        }
        for name, values in tracks.items()
    ]
    return {"path": path, "clip": {"fps": 1, "name": "default", "tracks": rows}}


def _robot(trace: Trace) -> RobotShapes:
    """Return the shapes of the trace's robot."""
    radii = trace.meta.get("foot_radius") or [0.0] * len(trace.foot_names)
    feet = dict(zip(trace.foot_names, (float(radius) for radius in radii), strict=True))
    return RobotShapes(trace.meta.get("urdf", ""), feet)


def _body_path(body: str) -> str:
    return f"{ROOT}/robot/{body.replace('/', '_')}"


def _arrow_path(foot: str) -> str:
    return f"{ROOT}/forces/{foot.replace('/', '_')}"


def _property(path: str, name: str, value: Any) -> Command:
    return {"type": "set_property", "path": path, "property": name, "value": value}


def _camera(reach: float) -> Command:
    """Return a camera ahead, to the right and above, looking at the trunk (three.js axes)."""
    x, y, z = 1.3 * reach, -2.0 * reach, 1.1 * reach
    return _property("/Cameras/default/rotated/<object>", "position", [x, z, -y])


def _arrow(path: str, width: float) -> list[Command]:
    """Return an arrow of unit length along z that shows through the robot."""
    shaft = Shape(cylinder(width, 0.75), Y_TO_Z, np.array([0.0, 0.0, 0.375]), ARROW_COLOR)
    point = cylinder(2.2 * width, 0.25, top_radius=0.0)
    head = Shape(point, Y_TO_Z, np.array([0.0, 0.0, 0.875]), ARROW_COLOR)
    see_through = {"depthTest": False, "transparent": True}
    return [
        _object(f"{path}/shaft", shaft, see_through),
        _object(f"{path}/head", head, see_through),
    ]


def _ground(trace: Trace, sizes: Sizes) -> list[Command]:
    """Return the ground under the whole path: a slab with a grid if level, else its surface."""
    spacing = 10.0 ** round(math.log10(0.5 * sizes.reach))
    margin = 5.0 * sizes.reach
    low = np.floor((trace.q[:, :2].min(axis=0) - margin) / spacing) * spacing
    high = np.ceil((trace.q[:, :2].max(axis=0) + margin) / spacing) * spacing
    spacing *= math.ceil(float(np.max(high - low)) / spacing / 500)
    terrain, above = terrain_of(trace), 2e-3 * sizes.reach
    if terrain is None:
        return _slab(low, high, spacing, sizes)
    lines = {
        "edges": (profile_edges(terrain, low, high, 0.5 * above), EDGE_COLOR),
        "patches": (patch_outlines(terrain, above), PATCH_COLOR),
    }
    drawn = [_lines(f"{ROOT}/ground/{k}", ends, c) for k, (ends, c) in lines.items() if len(ends)]
    if is_level(terrain):
        return [*_slab(low, high, spacing, sizes), *drawn]
    vertices, triangles = ground_mesh(terrain, low, high)
    return [_mesh(f"{ROOT}/ground/surface", vertices, triangles), *drawn]


def _slab(low: Array, high: Array, spacing: float, sizes: Sizes) -> list[Command]:
    """Return a slab with its top at the ground, and a grid on it."""
    centre, size, thick = 0.5 * (low + high), high - low, 0.1 * sizes.reach
    position = np.array([*centre, sizes.ground - 0.5 * thick])
    slab = Shape(box([*size, thick]), np.eye(3), position, GROUND_COLOR)
    z = sizes.ground + 1e-3 * sizes.reach
    grid = _grid(low, high, spacing, z)
    return [_object(f"{ROOT}/ground/slab", slab), _lines(f"{ROOT}/ground/grid", grid)]


def _grid(low: Array, high: Array, spacing: float, z: float, *, pieces: int = 12) -> Array:
    """Return the ends (2 K, 3) of grid lines over a rectangle [m].

    Lines come in pieces: one that passes behind the camera may be dropped as a whole.
    """
    x, y = (np.arange(low[k], high[k] + 0.5 * spacing, spacing) for k in range(2))
    cuts = [np.linspace(low[k], high[k], pieces + 1) for k in range(2)]
    along_y = [((a, b, z), (a, c, z)) for a in x for b, c in itertools.pairwise(cuts[1])]
    along_x = [((b, a, z), (c, a, z)) for a in y for b, c in itertools.pairwise(cuts[0])]
    return np.array(along_y + along_x).reshape(-1, 3)


def _object(path: str, shape: Shape, options: Mapping[str, Any] | None = None) -> Command:
    """Return the command that puts a shape at a path."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = shape.rotation, shape.position
    material = {
        "type": "MeshPhongMaterial",
        "color": _rgb(shape.color),
        "opacity": shape.color[3],
        "transparent": shape.color[3] < 1.0,
        "side": 2,
        **(options or {}),
    }
    return _set_object(path, "Mesh", dict(shape.geometry), material, pose)


def _mesh(path: str, vertices: Array, triangles: npt.NDArray[np.intp]) -> Command:
    """Return the command that draws triangles (F, 3) between vertices (V, 3) [m], facets flat."""
    position = _attribute(vertices)
    index = {"itemSize": 1, "type": "Uint32Array", "array": triangles.ravel().tolist()}
    geometry = {
        "type": "BufferGeometry",
        "data": {"attributes": {"position": position}, "index": index},
    }
    color = _rgb(GROUND_COLOR)
    material = {"type": "MeshPhongMaterial", "color": color, "side": 2, "flatShading": True}
    return _set_object(path, "Mesh", geometry, material, np.eye(4))


def _lines(
    path: str, points: Array, color: tuple[float, float, float, float] = LINE_COLOR
) -> Command:
    """Return the command that draws separate lines between pairs of points (2 K, 3) [m]."""
    data = {"attributes": {"position": _attribute(points)}}
    geometry = {"type": "BufferGeometry", "data": data}
    material = {"type": "LineBasicMaterial", "color": _rgb(color)}
    return _set_object(path, "LineSegments", geometry, material, np.eye(4))


def _attribute(points: Array) -> Command:
    """Return points (N, 3) [m] as three.js takes them."""
    array = np.round(points, DIGITS).ravel().tolist()
    return {"itemSize": 3, "type": "Float32Array", "array": array, "normalized": False}


def _set_object(path: str, kind: str, geometry: Command, material: Command, pose: Array) -> Command:
    """Return meshcat's set_object; `pose` (4, 4) of the shape within its path."""
    names = {"geometry": f"{path}#geometry", "material": f"{path}#material"}
    matrix = np.round(pose.T.ravel(), 9).tolist()
    return {
        "type": "set_object",
        "path": path,
        "object": {
            "metadata": {"version": 4.5, "type": "Object"},
            "geometries": [{"uuid": names["geometry"], **geometry}],
            "materials": [{"uuid": names["material"], **material}],
            "object": {"uuid": path, "type": kind, **names, "matrix": matrix},
        },
    }


def _rgb(color: tuple[float, float, float, float]) -> int:
    """Return 0xRRGGBB."""
    red, green, blue = (round(255 * min(max(part, 0.0), 1.0)) for part in color[:3])
    return (red << 16) + (green << 8) + blue
