"""The robot of a trace, built again from the data in the trace: URDF, payloads, pushes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.robot.loading.load_urdf import loaded_text
from hexapod_pin.robot.robot import Robot, robot_of
from hexapod_pin.scene.loaded_model import models_by_mass, native_push
from hexapod_pin.scene.loads import Push

if TYPE_CHECKING:
    import pinocchio as pin

KEPT_ROBOTS = 4
"""How many robots are remembered of traces: many traces of a sweep have the same."""

TRUNK_JOINT = 1
"""Index of the free-flyer in the model: what moves the trunk's contact points."""


class RecordedPush(NamedTuple):
    """A wrench on a point of a body, constant in world axes while it lasts.

    Attributes:
        joint: index of the joint that moves the body.
        point: in that joint's frame [m]. Shape (3,).
        force: [N]. Shape (3,).
        torque: [N m]. Shape (3,).
        start: [s].
        end: [s].
    """

    joint: int
    point: Array
    force: Array
    torque: Array
    start: float
    end: float


@dataclass(frozen=True, eq=False)
class RecordedRobot:
    """The robot that a trace was made with.

    Attributes:
        robot: as loaded, without payloads.
        model: with its payloads, and with the gravity of the run.
        contact_joints: index of the joint that moves each contact point of the trace, F of them.
        pushes: what pushed the robot besides its feet.
        damping: viscous, of URDF and motors [N m s/rad]. Shape (n,).
        armature: of the rotors, added to the joints' inertias [kg m^2]. Shape (n,).
    """

    robot: Robot = field(repr=False)
    model: pin.Model = field(repr=False)
    contact_joints: tuple[int, ...]
    pushes: tuple[RecordedPush, ...]
    damping: Array
    armature: Array

    @staticmethod
    def of(trace: Trace) -> RecordedRobot:
        """Build the robot of a trace.

        Raises:
            ParameterError: the run has no URDF, or its data do not make the robot of the
                arrays; names what is missing or does not fit.
        """
        text = trace.run.robot.urdf
        if text is None:
            raise ParameterError("Trace.run.robot.urdf", None, "known")
        try:
            return _build(trace, text)
        except HexapodError as error:
            if isinstance(error, ParameterError):
                raise
            hint = "The model that the trace was made with cannot be built again."
            raise ParameterError("Trace.run.robot", str(error), "that of a robot", hint) from error

    @property
    def total_mass(self) -> float:
        """With payloads [kg]."""
        return float(sum(body.mass for body in self.model.inertias))

    @property
    def gravity(self) -> Array:
        """Acceleration, world axes [m/s^2]. Shape (3,)."""
        return np.array(self.model.gravity.linear)

    def momenta(self, q: Array, v: Array) -> tuple[Array, Array, Array]:
        """Return linear momentum, angular momentum about the centre of mass, and that centre.

        Args:
            q: configurations. Shape (T, nq).
            v: velocities. Shape (T, nv).

        Returns:
            World axes [kg m/s, kg m^2/s, m]. Shape (T, 3) each.
        """
        import pinocchio as pin

        data, found = self.model.createData(), np.empty((len(q), 9))
        for k, (position, velocity) in enumerate(zip(q, v, strict=True)):
            h = pin.computeCentroidalMomentum(self.model, data, position, velocity)
            found[k, :3], found[k, 3:6], found[k, 6:] = h.linear, h.angular, data.com[0]
        return found[:, :3], found[:, 3:6], found[:, 6:]

    def joints_above(self, contact: int) -> tuple[int, ...]:
        """Return the actuated joints, as indices in the trace, that lie above a contact point."""
        column = {self.model.joints[j].idx_v - 6: j for j in range(2, self.model.njoints)}
        above = set(self.model.supports[self.contact_joints[contact]])
        return tuple(k for k in sorted(column) if column[k] in above)


def _build(trace: Trace, text: str) -> RecordedRobot:
    import pinocchio as pin

    run, scene = trace.run, trace.run.scene
    feet = run.case.feet or trace.foot_names
    robot = _robot(text, feet)
    if robot.joint_names != trace.joint_names:
        raise ParameterError("Trace.joint_names", trace.joint_names, "those of the trace's URDF")
    model = pin.Model(models_by_mass(robot)(() if scene is None else scene.mass_loads))
    model.gravity.linear = np.array(run.gravity)
    pushes = [load for load in (() if scene is None else scene.loads) if isinstance(load, Push)]
    damping, armature = _drives(robot, None if scene is None else scene.servo)
    return RecordedRobot(
        robot, model, _contact_joints(trace, robot, feet),
        tuple(RecordedPush(*native_push(robot, push)) for push in pushes), damping, armature,
    )  # fmt: skip


@lru_cache(maxsize=KEPT_ROBOTS)
def _robot(text: str, feet: tuple[str, ...]) -> Robot:
    return robot_of(loaded_text(text, "Trace.run.robot.urdf", LoadOptions(feet=feet)), "trace")


def _contact_joints(trace: Trace, robot: Robot, feet: Sequence[str]) -> tuple[int, ...]:
    """Return the joints that move the contact points: the feet, and after them the trunk's."""
    if trace.foot_names[: len(feet)] != tuple(feet):
        raise ParameterError("Trace.foot_names", trace.foot_names, f"those of the scene: {feet}")
    joints = [robot.model.getJointId(robot.foot(name).joint) for name in feet]
    return (*joints, *[TRUNK_JOINT] * (len(trace.foot_names) - len(feet)))


def _drives(robot: Robot, servo: Servo | None) -> tuple[Array, Array]:
    """Return damping and armature of the joints, of URDF and motors."""
    damping, armature = np.array(robot.damping), np.zeros(len(robot.joint_names))
    for j, motor in enumerate(() if servo is None else servo.motors(robot)):
        if motor is not None:
            damping[j] += motor.viscous_friction
            armature[j] = motor.armature
    return damping, armature
