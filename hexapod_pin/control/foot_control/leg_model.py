"""Foot control takes legs and centre of mass from a robot's model.

The feet of a plan are given to the native core as a table.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.drive.drive_law import armature
from hexapod_pin.robot.loading.backlash import without_backlash
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.robot.loading.load_urdf import loaded_text
from hexapod_pin.robot.robot import once_per_robot, robot_of

if TYPE_CHECKING:
    from hexapod_pin.native import LegChain, WalkTable
    from hexapod_pin.robot.robot import Robot


Key = TypeVar("Key")
Kept = TypeVar("Kept")


def known_scene(scene: Any) -> Any:
    """Return a scene as its controller knows it: without the free play of the robot's gears.

    Its servos have the gains of the joints that are left.
    """
    if not scene.robot.gaps:
        return scene
    robot, servo = _known_robot(scene.robot), scene.servos
    left = known_joints(scene.robot)
    gains = [tuple(map(float, gain[left])) for gain in servo.gains(scene.robot)]
    changes = {"kp": gains[0], "kd": gains[1]}
    return replace(scene, robot=robot, servo=servo.model_copy(update=changes))


@once_per_robot
def known_joints(robot: Robot) -> NDArray[np.intp]:
    """Return the indices of the joints that a controller knows: all but the gaps of gears. (m,)."""
    return np.flatnonzero([name not in robot.gaps for name in robot.joint_names])


@once_per_robot
def _known_robot(robot: Robot) -> Robot:
    """Return a robot without the free play of its gears."""
    feet = tuple(foot.name for foot in robot.feet)
    text = without_backlash(robot.urdf, robot.gaps)
    known = robot_of(loaded_text(text, robot.source, LoadOptions(feet=feet)), robot.source)
    return replace(known, posture=read_only(robot.posture[known_joints(robot)]))


def leg_chains(scene: Any, *, dry_friction: bool = True) -> list[LegChain]:
    """Return the legs in gait order, with masses (payloads aside), rotors and friction."""
    from hexapod_pin.native import LegChain

    robot = scene.robot
    rotors = armature(robot, scene.servos) + np.asarray(robot.model.armature)[6:]
    motors = scene.servos.motors(robot)
    viscous = np.array(robot.damping) + [m.viscous_friction if m else 0.0 for m in motors]
    dry = np.array(robot.friction) + [m.dry_friction if m else 0.0 for m in motors]
    dry *= dry_friction
    return [
        LegChain(
            np.ascontiguousarray(
                [
                    [*_link(robot, joint), rotors[index], viscous[index], dry[index]]
                    for joint, index in zip(leg.joints, row, strict=True)
                ]
            ),
            leg.foot,
        )
        for leg, row in zip(leg_group(robot).legs, leg_group(robot).joint_index, strict=True)
    ]


def _link(robot: Robot, joint: str) -> list[float]:
    """Return axis, origin, mass, centre and inertia of a joint's link, base frame, angles of 0."""
    import pinocchio as pin

    model, data = robot.model, robot.model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    number = model.getJointId(joint)
    place, body = data.oMi[number], model.inertias[number]
    inertia = place.rotation @ body.inertia @ place.rotation.T
    axis = data.J[3:, model.idx_vs[number]]
    return [*axis, *place.translation, body.mass, *place.act(body.lever), *inertia.ravel()]


def standing_centre(robot: Robot) -> Array:
    """Return the centre of mass of the standing posture in the base frame [m]. Shape (3,)."""
    import pinocchio as pin

    q = np.concatenate([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], robot.posture])
    return np.array(pin.centerOfMass(robot.model, robot.model.createData(), q))


def trunk_moment(robot: Robot) -> Array:
    """Return the sum of mass times centre of all that is no leg, base frame [kg m]. Shape (3,)."""
    import pinocchio as pin

    model, data = robot.model, robot.model.createData()
    pin.forwardKinematics(model, data, robot.stand().q)
    trunk = data.oMi[1].inverse()
    moment = robot.total_mass * standing_centre(robot)
    for leg in leg_group(robot).legs:
        for joint in leg.joints:
            number = model.getJointId(joint)
            body = model.inertias[number]
            moment -= body.mass * trunk.act(data.oMi[number].act(body.lever))
    return moment


def foot_stiffness(robot: Robot, servo: Any) -> Array:
    """Return the stiffness of each standing foot that servos give it, base axes [N/m].

    (J diag(1 / kp) J^T)^-1 in the standing posture, the contact's own compliance aside.

    Returns:
        Shape (6, 3, 3).
    """
    six = leg_group(robot)
    jacobian = six.kinematics.jacobian(six.kinematics.posture[:, None])[:, 0]
    kp = servo.gains(robot)[0][six.joint_index]
    compliance = jacobian @ (np.swapaxes(jacobian, 1, 2) / kp[..., None])
    return np.asarray(np.linalg.inv(compliance))


# The plan that foot control starts from: a walk's feet as a table for the native core.

ROWS_PER_CYCLE = 512
"""Rows of a cycle: cubics between them are off by 1e-6 m at most, on arcs by 2e-6 m."""

KEPT = 64
"""How many values of one kind are cached: first postures of walks, laws, loops."""

CYCLES_AT_ONCE = 16
"""Cycles by which the table of a walk that does not repeat grows."""


class PlannedWalk:
    """Feet, speed and schedule of a walk at any time.

    Attributes:
        table: for the core.
    """

    def __init__(self, robot: Robot, control: Any) -> None:
        """Tabulate a walk.

        Args:
            robot: whose walk it is.
            control: has `path(robot)`, a `gait`, and `plan(robot, duration)`, which refuses walks
                that are impossible. A walk with a velocity command is not checked beforehand.

        Raises:
            GaitError: the robot cannot walk it.
        """
        from hexapod_pin.native import WalkTable

        self._path = control.path(robot)
        gait = self._path.gait
        if self._path.periodic:
            control.plan(robot, gait.cycle_time)
        self._cycle = gait.cycle_time
        self._spacing = self._cycle / ROWS_PER_CYCLE
        self.repeats = bool(self._path.periodic and getattr(control, "stop_at", None) is None)
        steady = self._cycle * np.ceil(self._path.steady_from / self._cycle - 1e-9)
        self.table: WalkTable = WalkTable(
            list(gait.phases), gait.duty, self._cycle, self._spacing,
            steady if self.repeats else -1.0,
        )  # fmt: skip
        self._rows = 0
        self._grow(round(steady / self._cycle) + 1)

    def reach(self, time: float) -> None:
        """Extend the table to cover a time [s], and the swing after it."""
        while not self.repeats and time + 2.0 * self._cycle > self.table.end:
            self._grow(CYCLES_AT_ONCE)

    def _grow(self, cycles: int) -> None:
        """Append cycles to the table."""
        count = cycles * ROWS_PER_CYCLE + (2 if self._rows == 0 else 0)
        time = self._spacing * np.arange(self._rows, self._rows + count)
        feet, velocity = self._path.positions_and_velocities(time)
        self.table.append(
            np.ascontiguousarray(feet),
            np.ascontiguousarray(velocity),
            np.ascontiguousarray(self._path.stance(time)),
            np.ascontiguousarray(self._path.body.pose_and_twist(time)[1]),
        )
        self._rows += count


@once_per_robot
def _postures(robot: Robot) -> OrderedDict[Any, Array]:
    """Return the first postures of walks."""
    return OrderedDict()


def first_posture(robot: Robot, control: Any) -> Array:
    """Return the joint angles of a walk's beginning, found once for equal walks [rad]. (n,)."""

    def make() -> Array:
        feet = control.path(robot).positions(np.zeros(1))
        return read_only(leg_group(robot).joint_angles(feet)[0])

    return once(_postures(robot), control, make)


def once(kept: OrderedDict[Key, Kept], key: Key, make: Callable[[], Kept]) -> Kept:
    """Return the value of a key, made once; the oldest of more than `KEPT` is dropped."""
    if key not in kept:
        kept[key] = make()
        while len(kept) > KEPT:
            kept.popitem(last=False)
    return kept[key]
