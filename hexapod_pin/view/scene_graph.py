"""The scene graph of a playback holds robot, ground and force arrows over time.

The output is meshcat's command language as plain data (dicts of numbers and text), the same for a
file and for a live viewer. Lengths in metres, world axes, quaternions x y z w.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ViewerError
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.view.ground_shapes import (
    Sizes,
    eye_level,
    ground_commands,
    middle,
    require_in,
    shaking,
    terrain_of,
)
from hexapod_pin.view.mesh_store import MeshStore
from hexapod_pin.view.meshcat_commands import DIGITS, ROOT, Command, mesh_object, set_property
from hexapod_pin.view.robot_shapes import Y_TO_Z, DrawnShape, RobotShapes, cylinder

LOOP_REPETITIONS = 10**9  # repetitions of a looped animation
PICTURE_RATES = (1e-3, 1e6, "1/s")  # of fps
SPEEDS = (1e-6, 1e6, "[-]")
SKY = ((0.80, 0.88, 0.95), (0.97, 0.98, 1.0))  # top, bottom


def scene_commands(
    trace: Trace, *, force_scale: float | None = None, shapes: RobotShapes | None = None
) -> list[Command]:
    """Return the commands that set up the still picture.

    Args:
        trace: what to show.
        force_scale: arrow length per force [m/N]; None fits it to the robot's weight.
        shapes: of the robot, see `meshed_robot`; None draws it without meshes.

    Raises:
        ViewerError: the trace's URDF cannot be drawn.
        ParameterError: `force_scale` is out of range.
    """
    sizes = Sizes.of(trace, force_scale)
    r = sizes.reach
    sky = backdrop((1.3 * r, -2.0 * r, 1.1 * r))  # seen from ahead, from the right and from above
    return [*sky, *robot_commands(trace, sizes, shapes=shapes), *ground_commands(trace, sizes)]


def backdrop(camera: tuple[float, float, float]) -> list[Command]:
    """Return the sky, and a camera at a place [m] that looks at the origin."""
    x, y, z = camera
    return [
        set_property("/Grid", "visible", False),
        set_property("/Axes", "visible", False),
        set_property("/Background", "top_color", list(SKY[0])),
        set_property("/Background", "bottom_color", list(SKY[1])),
        set_property("/Cameras/default/rotated/<object>", "position", [x, z, -y]),
    ]


def robot_commands(
    trace: Trace, sizes: Sizes, *, root: str = ROOT, shapes: RobotShapes | None = None
) -> list[Command]:
    """Return the robot's links and the arrows of its forces, not yet in place."""
    commands = []
    for body, parts in (shapes or _robot(trace)).bodies.items():
        for k, shape in enumerate(parts):
            commands.append(mesh_object(f"{_body_path(root, body)}/{k}", shape))
    for foot in trace.foot_names if "contacts" in trace.recorded else ():
        commands += arrow(_arrow_path(root, foot), 0.02 * sizes.reach)
    return commands


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
        ParameterError: `fps`, `speed` or `force_scale` is out of range.
    """
    require_rates(fps, speed)
    index = frame_samples(trace, fps)
    times = np.round((trace.time[index] - trace.time[0]) / speed, DIGITS)
    if len(index) == 1:
        index, times = np.repeat(index, 2), np.array([0.0, 1.0 / fps])
    clips = motion_clips(trace, index, times, Sizes.of(trace, force_scale))
    return animation_of(clips, loop=loop)


def require_rates(fps: float, speed: float = 1.0) -> None:
    """Refuse rates of pictures and speeds that no picture is made for.

    Raises:
        ParameterError: names the number and its range.
    """
    require_in("fps", fps, PICTURE_RATES)
    require_in("speed", speed, SPEEDS)


def motion_clips(
    trace: Trace,
    index: npt.NDArray[np.intp],
    times: Array,
    sizes: Sizes,
    *,
    root: str = ROOT,
    place: Array | None = None,
) -> list[Command]:
    """Return the motion of everything in a run, a clip per path.

    Args:
        trace: what moves.
        index: samples to show. Shape (K,).
        times: when [s]. Shape (K,).
        sizes: lengths that fit the picture.
        root: path of everything in the run.
        place: of the run's world in the picture [m], shape (K, 3); None keeps the trunk at the
            origin, but for its height.

    Raises:
        ViewerError: a sample is not finite, or the trace's URDF cannot be drawn.
    """
    require_finite(trace, index)
    motion = _motion(trace, index, sizes, root)
    motion[root] = {"position": -trunk_focus(trace, index) if place is None else place}
    return [clip(path, times, tracks) for path, tracks in motion.items()]


def trunk_focus(trace: Trace, index: npt.NDArray[np.intp]) -> Array:
    """Return x and y of the robot's middle at some samples, and the eye's height (K, 3) [m]."""
    return np.column_stack([middle(trace, index), np.full(len(index), eye_level(trace))])


def animation_of(clips: list[Command], *, loop: bool = True) -> Command:
    """Return the command that plays clips."""
    options = {"play": True, "repetitions": LOOP_REPETITIONS if loop else 1}
    return {"type": "set_animation", "path": "", "animations": clips, "options": options}


def frame_samples(trace: Trace, fps: float) -> npt.NDArray[np.intp]:
    """Return the indices of the samples nearest to the picture times, each once."""
    time = trace.time
    if len(time) == 1:
        return np.zeros(1, dtype=np.intp)
    # of the pictures that are nearest to a sample, one is its neighbour: others are not looked at
    place = np.floor((time - time[0]) * fps)[:, None] + np.arange(-1.0, 3.0)
    pictures = np.unique(np.clip(place, 0.0, np.ceil((time[-1] - time[0]) * fps - 0.5)))
    return np.unique(nearest_samples(time, time[0] + pictures / fps))


def nearest_samples(time: Array, moments: Array) -> npt.NDArray[np.intp]:
    """Return the index of the sample nearest to each moment; the last one after the end."""
    right = np.clip(np.searchsorted(time, moments), 1, max(len(time) - 1, 1))
    left = right - 1
    right = np.minimum(right, len(time) - 1)
    return np.where(moments - time[left] <= time[right] - moments, left, right)


def require_finite(trace: Trace, index: npt.NDArray[np.intp]) -> None:
    """Refuse samples that a viewer cannot draw.

    Raises:
        ViewerError: names the first that is not finite.
    """
    drawn = ("q", "foot_position", "foot_force") if "contacts" in trace.recorded else ("q",)
    for name in drawn:
        values = getattr(trace, name)[index]
        good = np.isfinite(values).reshape(len(index), -1).all(axis=1)
        if not good.all():
            sample = int(index[np.argmin(good)])
            raise ViewerError(
                f"{name} is not finite in sample {sample} (t = {trace.time[sample]:g} s); "
                "it cannot be drawn."
            )


def _motion(
    trace: Trace, index: npt.NDArray[np.intp], sizes: Sizes, root: str
) -> dict[str, dict[str, Array]]:
    """Return the tracks (K, 3 or 4) of everything that moves in a run's world, by path."""
    q, motion = trace.q[index], {}
    lift = shaking(terrain_of(trace), trace.time[index])
    if lift is not None:
        motion[f"{root}/ground"] = {"position": lift[:, None] * (0.0, 0.0, 1.0)}
    for body, (position, attitude) in _robot(trace).poses(q, trace.joint_names).items():
        motion[_body_path(root, body)] = {"position": position, "quaternion": attitude}
    radii = trace.run.robot.radii(len(trace.foot_names))
    for f, foot in enumerate(trace.foot_names if "contacts" in trace.recorded else ()):
        contact = trace.foot_position[index, f] - radii[f] * trace.foot_normal[index, f]
        pointing = arrow_tracks(trace.foot_force[index, f] * sizes.force_scale)
        motion[_arrow_path(root, foot)] = {"position": contact, **pointing}
    return motion


def clip(path: str, times: Array, tracks: Mapping[str, Array]) -> Command:
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


def meshed_robot(
    trace: Trace, store: MeshStore, package_path: Sequence[str | Path] = ()
) -> RobotShapes:
    """Return the shapes of the trace's robot, with its meshes.

    Meshes are looked for beside the file that the robot was loaded from.

    Args:
        trace: what is drawn.
        store: takes the meshes; one for a picture.
        package_path: folders that hold ROS packages, looked into first.

    Raises:
        ViewerError: the trace's URDF cannot be drawn.
    """
    robot = trace.run.case.robot_file
    source = str(robot.get("source", ""))
    folders = (*package_path, *robot.get("options", {}).get("package_path", ()))
    known = bool(source or folders)
    return _robot(trace, ResourceFinder(source or "robot.urdf", folders) if known else None, store)


def _robot(
    trace: Trace, finder: ResourceFinder | None = None, store: MeshStore | None = None
) -> RobotShapes:
    """Return the shapes of the trace's robot; without a store, without meshes."""
    radii = trace.run.robot.radii(len(trace.foot_names))
    feet = dict(zip(trace.foot_names, (float(radius) for radius in radii), strict=True))
    return RobotShapes(trace.run.robot.urdf or "", feet, finder=finder, store=store)


def _body_path(root: str, body: str) -> str:
    return f"{root}/robot/{body.replace('/', '_')}"


def _arrow_path(root: str, foot: str) -> str:
    return f"{root}/forces/{foot.replace('/', '_')}"


# Arrows that show foot forces: their shape, and how they point and grow.

HIDDEN_ARROW_SCALE = 1e-6  # scale of an arrow without force; 0 would have no inverse
LONGEST_ARROW = 1e6  # [m]; viewers compute in single precision
ARROW_COLOR = (0.9, 0.15, 0.1, 0.9)


def arrow_tracks(vector: Array) -> dict[str, Array]:
    """Return attitude and scale of a unit arrow along z that is to show `vector` (K, 3) [m]."""
    length = np.minimum(np.linalg.norm(vector, axis=1), LONGEST_ARROW)
    shown = length > 1e-4
    unit = np.where(shown[:, None], vector, (0.0, 0.0, 1.0))
    unit = unit / np.linalg.norm(unit, axis=1, keepdims=True)
    turn = np.column_stack([-unit[:, 1], unit[:, 0], np.zeros(len(unit)), 1.0 + unit[:, 2]])
    turn[unit[:, 2] < -1.0 + 1e-9] = (1.0, 0.0, 0.0, 0.0)
    scale = np.where(shown[:, None], np.column_stack([shown, shown, length]), HIDDEN_ARROW_SCALE)
    return {"quaternion": turn / np.linalg.norm(turn, axis=1, keepdims=True), "scale": scale}


def arrow(path: str, width: float) -> list[Command]:
    """Return an arrow of unit length along z that shows through the robot."""
    shaft = DrawnShape(cylinder(width, 0.75), Y_TO_Z, np.array([0.0, 0.0, 0.375]), ARROW_COLOR)
    point = cylinder(2.2 * width, 0.25, top_radius=0.0)
    head = DrawnShape(point, Y_TO_Z, np.array([0.0, 0.0, 0.875]), ARROW_COLOR)
    see_through = {"depthTest": False, "transparent": True}
    return [
        mesh_object(f"{path}/shaft", shaft, see_through),
        mesh_object(f"{path}/head", head, see_through),
    ]
