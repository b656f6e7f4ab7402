"""What a viewer is told to draw: the robot, the ground, force arrows, and how they move.

The output is meshcat's command language as plain data (dicts of numbers and text), the same for a
file and for a live viewer. Lengths in metres, world axes, quaternions x y z w.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, ViewerError
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.ground_commands import ground_commands
from hexapod_pin.view.ground_mesh import shaking, terrain_of
from hexapod_pin.view.meshcat_commands import DIGITS, ROOT, Command, mesh_object, set_property
from hexapod_pin.view.robot_shapes import Y_TO_Z, DrawnShape, RobotShapes, cylinder
from hexapod_pin.view.view_sizes import Sizes

HIDDEN_ARROW_SCALE = 1e-6  # scale of an arrow without force; 0 would have no inverse
LOOP_REPETITIONS = 10**9  # repetitions of a looped animation
ARROW_COLOR = (0.9, 0.15, 0.1, 0.9)
SKY = ((0.80, 0.88, 0.95), (0.97, 0.98, 1.0))  # top, bottom


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
        set_property("/Grid", "visible", False),
        set_property("/Axes", "visible", False),
        set_property("/Background", "top_color", list(SKY[0])),
        set_property("/Background", "bottom_color", list(SKY[1])),
        _camera(sizes.reach),
    ]
    for body, shapes in _robot(trace).bodies.items():
        for k, shape in enumerate(shapes):
            commands.append(mesh_object(f"{_body_path(body)}/{k}", shape))
    for foot in trace.foot_names:
        commands += _arrow(_arrow_path(foot), 0.02 * sizes.reach)
    return [*commands, *ground_commands(trace, sizes)]


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
    options = {"play": True, "repetitions": LOOP_REPETITIONS if loop else 1}
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
    scale = np.where(shown[:, None], np.column_stack([shown, shown, length]), HIDDEN_ARROW_SCALE)
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


def _camera(reach: float) -> Command:
    """Return a camera ahead, to the right and above, looking at the trunk (three.js axes)."""
    x, y, z = 1.3 * reach, -2.0 * reach, 1.1 * reach
    return set_property("/Cameras/default/rotated/<object>", "position", [x, z, -y])


def _arrow(path: str, width: float) -> list[Command]:
    """Return an arrow of unit length along z that shows through the robot."""
    shaft = DrawnShape(cylinder(width, 0.75), Y_TO_Z, np.array([0.0, 0.0, 0.375]), ARROW_COLOR)
    point = cylinder(2.2 * width, 0.25, top_radius=0.0)
    head = DrawnShape(point, Y_TO_Z, np.array([0.0, 0.0, 0.875]), ARROW_COLOR)
    see_through = {"depthTest": False, "transparent": True}
    return [
        mesh_object(f"{path}/shaft", shaft, see_through),
        mesh_object(f"{path}/head", head, see_through),
    ]
