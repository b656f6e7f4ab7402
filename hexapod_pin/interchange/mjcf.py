"""MJCF out: a robot or scene for MuJoCo, with a planned walk as keyframes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import Controller, planned_motion
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import PatchedGround, ShakingGround
from hexapod_pin.interchange.mjcf_text import (
    NOTHING_DRAWN,
    Drawn,
    JointDrives,
    Keyframe,
    MjcfOptions,
    mjcf_text,
)
from hexapod_pin.robot.description.urdf_writer import number, numbers
from hexapod_pin.robot.link_shapes import mesh_finder
from hexapod_pin.robot.robot import Robot
from hexapod_pin.scene.scene import Scene, standing_on
from hexapod_pin.user_file import user_path
from hexapod_pin.view.mesh_store import MeshStore
from hexapod_pin.view.robot_shapes import Y_TO_Z, RobotShapes

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hexapod_pin.arrays import Array
    from hexapod_pin.control.joint_trajectory import JointTrajectory
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.view.robot_shapes import DrawnShape


STAND = "stand"
"""Name of the first keyframe: the standing posture at rest."""

MOST_KEYFRAMES = 100_000
"""Of a file: each has every joint twice."""

STEP = 1e-3
"""Step of MuJoCo's integration in a file written here [s]; its own default is 2 ms."""

OPTIONS = MjcfOptions(STEP, "implicitfast", "elliptic", impratio=10.0, contact_time=5e-3)
"""Assumed. With MuJoCo's own `solref`, 20 ms, feet on light legs sink by up to 11 mm."""


@checked
def write_mjcf(
    scene: Scene | Robot,
    path: str | Path,
    *,
    controller: Controller | FeedbackController | Gait | None = None,
    duration: float = 10.0,
    rate: float = 50.0,
    drawn: bool = True,
    package_path: Sequence[str | Path] = (),
) -> Path:
    """Write a robot as MJCF, which MuJoCo opens and walks.

    Written are the floating base, the ground, the bodies with the masses of the scene's loads,
    joint limits, damping, dry friction and rotor inertia, the feet's spheres with the coefficient
    of friction, a position actuator per joint with the gains and the torque limit of its servo,
    the shapes of the links, and keyframes. Meshes are files beside it, NAME_mesh_0.stl and so on;
    where some are not found, a comment of the file says so, and what is drawn instead.

    Keyframe 0 is the standing posture. With a controller the planned walk follows, a keyframe
    every 1 / rate from t = 0 on. A keyframe's `qpos` has the planned pose of the base, as on even
    ground, and joint angles; its `ctrl` are the set-points of the actuators, which are
    q_ref + kd / kp v_ref, since MuJoCo's servo is kp (ctrl - q) - kd v and ours is
    kp (q_ref - q) + kd (v_ref - v).

    Args:
        scene: robot, ground, friction, servos, masses; of a robot its default scene.
        path: of the file; its folder must exist.
        controller: of the walk, or its gait; None: the standing posture alone.
        duration: of the walk [s].
        rate: keyframes per second [Hz].
        drawn: whether the shapes of the links are written; without them only feet are seen.
        package_path: folders in which meshes are looked for first; then those that the robot was
            loaded with.

    Returns:
        The path written to.

    Raises:
        ParameterError: the joints of the scene follow a motion, a controller without a plan, a
            duration or rate out of range, or more than 100 000 keyframes.
        GaitError, ReachError: the robot cannot walk so.
        TraceFileError: the file or a mesh cannot be written.
    """
    written, _ = write_mjcf_with_notes(
        scene, path, controller=controller, duration=duration, rate=rate, drawn=drawn,
        package_path=package_path,
    )  # fmt: skip
    return written


def write_mjcf_with_notes(
    scene: Scene | Robot, path: str | Path, *,
    controller: Controller | FeedbackController | Gait | None, duration: float, rate: float,
    drawn: bool = True, package_path: Sequence[str | Path] = (),
) -> tuple[Path, list[str]]:  # fmt: skip
    """Write as `write_mjcf`; also return a sentence on each part that the file does not have."""
    if isinstance(scene, Robot):
        scene = Scene(scene)
    target = user_path(path)
    if scene.prescribed:
        raise ParameterError("Scene.prescribed", True, "False in MJCF: its actuators are servos")
    keyframes = [standing_keyframe(scene)]
    if controller is not None:
        walk = KinematicControl(controller) if isinstance(controller, Gait) else controller
        keyframes += walk_keyframes(scene, walk, duration, rate)
    prefix = f"{target.stem}_"
    shapes = DrawnRobot(NOTHING_DRAWN, {}, ())
    if drawn:
        shapes = drawn_robot(scene.robot, prefix, package_path)
    notes = [*mjcf_losses(scene), *_missing_meshes(shapes.notes)]
    text = mjcf_text(
        scene, JointDrives.of(scene.robot, scene.servos), OPTIONS, drawn=shapes.drawn,
        keyframes=keyframes, remarks=[*_head(scene), *notes],
    )  # fmt: skip
    for name, content in shapes.files.items():
        write_atomically(target.with_name(name), content)
    return write_atomically(target, text), notes


def _head(scene: Scene) -> list[str]:
    """Return where the model is from and what is assumed in it."""
    robot = scene.robot
    return [
        f"{robot.name}, written by hexapod_pin. SI units, angles in rad. {robot.provenance}",
        *(f"assumed: {text}" for text in scene.assumed),
    ]


def mjcf_losses(scene: Scene) -> list[str]:
    """Return a sentence on each part of a scene that its MJCF does not have."""
    found = [
        f"not in this file: the contact law ({scene.contact.describe()}): MuJoCo's own acts, with "
        f"the largest coefficient of friction, {scene.contact.friction.limit:g}"
    ]
    motors = [motor for motor in scene.servos.motors(scene.robot) if motor is not None]
    if motors:
        found.append(
            "not in this file: the motors' torque-speed line; the torque is limited by the stall "
            "torque at any speed"
        )
    if any(motor.gear_friction for motor in motors):
        found.append("not in this file: the gears' friction that depends on the load")
    kinds = sorted({load.kind for load in scene.loads} - {load.kind for load in scene.mass_loads})
    if kinds:
        found.append(f"not in this file: loads of kind {', '.join(kinds)}")
    if scene.body_contact:
        found.append("not in this file: contact between trunk and ground")
    if isinstance(scene.terrain, PatchedGround | ShakingGround):
        kind = scene.terrain.kind
        found.append(f"not in this file: what the {kind} ground adds to the shape of the ground")
    if any(foot.radius <= 0.0 for foot in scene.robot.feet):
        found.append("point feet are spheres of 0.01 mm")
    return found


def _missing_meshes(reasons: Sequence[str]) -> list[str]:
    """Return one sentence on the meshes that are not drawn, with the reason of the first."""
    if not reasons:
        return []
    what = "1 mesh is" if len(reasons) == 1 else f"{len(reasons)} meshes are"
    first = "" if len(reasons) == 1 else "the first: "
    return [
        f"{what} not in this file, and a body without another shape is drawn as rods of an assumed "
        f"thickness; {first}{reasons[0]}"
    ]


# Keyframes: the standing posture, and a planned walk.


def standing_keyframe(scene: Scene) -> Keyframe:
    """Return the standing posture at rest on the ground."""
    state = standing_on(scene, scene.robot.posture)
    return Keyframe(STAND, 0.0, state.q, state.joints)


def walk_keyframes(
    scene: Scene, controller: Controller | FeedbackController, duration: float, rate: float
) -> list[Keyframe]:
    """Return a planned walk at a rate, from t = 0 to the duration.

    Args:
        scene: robot, ground and servos.
        controller: plans the walk.
        duration: [s].
        rate: keyframes per second [Hz].

    Raises:
        ParameterError, GaitError, ReachError: as `write_mjcf`.
    """
    if not (np.isfinite(rate) and rate > 0.0):
        raise ParameterError("rate", rate, "finite and above 0 Hz")
    if not duration * rate <= MOST_KEYFRAMES:
        allowed = f"at most {MOST_KEYFRAMES / rate:g} s: {MOST_KEYFRAMES} keyframes at {rate:g} Hz"
        raise ParameterError("duration", duration, allowed)
    if isinstance(controller, FeedbackController):
        raise ParameterError(
            "controller", type(controller).__name__, "one that plans its set-points before a run",
            "A controller that reacts to what it measures has no keyframes.",
        )  # fmt: skip
    plan = controller.plan(scene.robot, duration)
    time = np.arange(round(duration * rate) + 1) / rate
    q, v = planned_motion(plan, time)
    kp, kd = scene.servos.gains(scene.robot)
    lead = np.divide(kd, kp, out=np.zeros_like(kd), where=kp > 0.0)
    poses = _base_poses(scene, controller, plan, time)
    rows = zip(time.tolist(), np.hstack([poses, q]), q + lead * v, strict=True)
    return [Keyframe(f"walk_{k}", t, row, control) for k, (t, row, control) in enumerate(rows)]


def _base_poses(scene: Scene, controller: Controller, plan: JointTrajectory, time: Array) -> Array:
    """Return the planned poses of the base: position [m], quaternion x, y, z, w. Shape (K, 7)."""
    import pinocchio as pin

    start = pin.XYZQUATToSE3(standing_on(scene, plan.q[0], plan.start_pose).q[:7])
    planar = np.outer(time * plan.speed, np.append(plan.travel_direction, 0.0))
    offsets = [pin.SE3.Identity() for _ in time]
    if isinstance(controller, KinematicControl):
        planar = controller.path(scene.robot).body_pose(time)
        if controller.body is not None:
            offset = controller.body.offset(time)
            offsets = [
                pin.SE3(np.array(turn), np.array(place))
                for turn, place in zip(offset.rotation, offset.position, strict=True)
            ]
    level = start * offsets[0].inverse()
    found = []
    for (x, y, yaw), more in zip(planar, offsets, strict=True):
        moved = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, float(yaw)), np.array([x, y, 0.0]))
        found.append(pin.SE3ToXYZQUAT(level * moved * more))
    return np.array(found)


# What MuJoCo draws of a robot: the shapes of its links, and meshes in files beside the model.


MESH_FACES = (1, 200_000)
"""Triangles of an STL file that MuJoCo reads."""

LEAST_VERTICES = 4
"""Different vertices of a mesh that it reads."""

UNSEEN = 'contype="0" conaffinity="0" group="2"'
"""What is drawn has no contact; viewers show group 2."""


class DrawnRobot(NamedTuple):
    """What is drawn, the files that it needs, and what cannot be drawn.

    Attributes:
        drawn: elements of the model.
        files: content of each mesh file by its name.
        notes: a sentence on each mesh that is left out.
    """

    drawn: Drawn
    files: Mapping[str, bytes]
    notes: Sequence[str]


def drawn_robot(robot: Robot, prefix: str, package_path: Sequence[str | Path] = ()) -> DrawnRobot:
    """Return the shapes that a playback shows, as MuJoCo has them.

    Boxes, cylinders and spheres are as the robot's file has them; meshes are decimated as in a
    playback. A body without either is a rod from its joint to the next joint or foot.

    Args:
        robot: the robot.
        prefix: with which the names of the mesh files begin, which lie beside the model.
        package_path: folders in which meshes are looked for before those of the robot's options.
    """
    finder = mesh_finder(robot, package_path)
    feet = {foot.name: foot.radius for foot in robot.feet}
    shapes = RobotShapes(robot.urdf, feet, finder=finder, store=MeshStore())
    meshes = _Meshes(prefix)
    geoms = {
        body: [text for shape in drawn if (text := _geom(shape, meshes))]
        for body, drawn in shapes.bodies.items()
    }
    return DrawnRobot(
        Drawn(geoms, meshes.elements), meshes.files, tuple(dict.fromkeys(shapes.notes))
    )


class _Meshes:
    """The mesh files of a model, each geometry once."""

    def __init__(self, prefix: str) -> None:
        self.prefix, self.files = prefix, dict[str, bytes]()
        self.elements: list[str] = []
        self._names: dict[int, str | None] = {}

    def name(self, geometry: Any) -> str | None:
        """Return the name of a mesh; None of one that MuJoCo would refuse."""
        key = id(geometry)
        if key not in self._names:
            data = geometry["data"]
            vertices = data["attributes"]["position"]["array"].reshape(-1, 3)
            faces = data["index"]["array"].reshape(-1, 3)
            self._names[key] = self._add(vertices[faces.astype(np.int64)])
        return self._names[key]

    def _add(self, triangles: Any) -> str | None:
        low, high = MESH_FACES
        few = len(np.unique(triangles.reshape(-1, 3), axis=0)) < LEAST_VERTICES
        if few or not low <= len(triangles) <= high:
            return None
        name = f"mesh_{len(self.files)}"
        file = f"{self.prefix}{name}.stl"
        self.files[file] = stl(triangles)
        # a mesh that is not closed has no volume, of which MuJoCo would make its inertia
        self.elements.append(f'<mesh name="{name}" file={quoteattr(file)} inertia="shell"/>')
        return name


def stl(triangles: Any) -> bytes:
    """Return triangles (F, 3, 3) [m] as a binary STL file."""
    rows = np.zeros(
        len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")]
    )
    rows["corners"] = triangles
    count = len(triangles).to_bytes(4, "little")
    return b"".join((bytes(80), count, rows.tobytes()))


def _geom(shape: DrawnShape, meshes: _Meshes) -> str:
    """Return a <geom> without contact; empty where MuJoCo has no such shape."""
    import pinocchio as pin

    geometry, turn = shape.geometry, shape.rotation
    kind = geometry["type"]
    if kind == "BoxGeometry":
        half = [0.5 * geometry[side] for side in ("width", "height", "depth")]
        body = f'type="box" size="{numbers(half)}"'
    elif kind == "SphereGeometry":
        body = f'type="sphere" size="{number(geometry["radius"])}"'
    elif kind == "CylinderGeometry":
        size = (geometry["radiusBottom"], 0.5 * geometry["height"])
        body, turn = f'type="cylinder" size="{numbers(size)}"', turn @ Y_TO_Z.T
    else:
        name = meshes.name(geometry)
        if name is None:
            return ""
        body = f'type="mesh" mesh="{name}"'
    x, y, z, w = pin.Quaternion(np.array(turn)).coeffs().tolist()
    place = f'pos="{numbers(shape.position.tolist())}" quat="{numbers((w, x, y, z))}"'
    return f'<geom {body} {place} {UNSEEN} rgba="{numbers(shape.color)}"/>'
