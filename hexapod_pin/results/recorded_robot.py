"""The robot of a trace, built again from what the trace says of it: URDF, payloads, pushes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.description.urdf_file import parse_urdf
from hexapod_pin.robot.loading.pin_model import mass_change, placement, with_mass_changes
from hexapod_pin.robot.robot import Robot, robot_of
from hexapod_pin.spec import parsed_toml

if TYPE_CHECKING:
    import pinocchio as pin

KNOWN_LOADS = ("payload", "mass-factor", "removed-mass", "push")
"""Kinds of loads that a model can be built with again."""

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
            ParameterError: `meta` has no URDF, or what it says does not make the robot of the
                arrays; names what is missing or does not fit.
        """
        text = trace.meta.get("urdf")
        if not isinstance(text, str):
            raise ParameterError("Trace.meta", sorted(trace.meta), "given with the robot's urdf")
        try:
            return _build(trace, text)
        except HexapodError as error:
            if isinstance(error, ParameterError):
                raise
            hint = "The model that the trace was made with cannot be built again."
            raise ParameterError("Trace.meta", str(error), "that of a robot", hint) from error

    @property
    def mass(self) -> float:
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
    scene = parsed_toml(str(trace.meta.get("scene", "")))
    loads = [load for load in scene.get("loads", ()) if load.get("kind") != "lost-leg"]
    unknown = {load.get("kind") for load in loads} - set(KNOWN_LOADS)
    if unknown:
        allowed = ", ".join(KNOWN_LOADS)
        raise ParameterError("scene.loads.kind", sorted(map(str, unknown)), f"of {allowed}")
    feet = scene.get("robot", {}).get("feet", trace.foot_names)
    robot = _robot(text, tuple(feet))
    if robot.joint_names != trace.joint_names:
        raise ParameterError("Trace.joint_names", trace.joint_names, "those of the trace's URDF")
    changes = [change for load in loads if (change := mass_change(load)) is not None]
    model = with_mass_changes(robot.model, changes)
    model.gravity.linear = np.array(trace.meta.get("gravity", (0.0, 0.0, -9.81)), dtype=float)
    damping, armature = _drives(robot, scene)
    return RecordedRobot(
        robot, model, _contact_joints(trace, robot, feet),
        tuple(_push(model, load) for load in loads if load["kind"] == "push"), damping, armature,
    )  # fmt: skip


@lru_cache(maxsize=KEPT_ROBOTS)
def _robot(text: str, feet: tuple[str, ...]) -> Robot:
    return robot_of(parse_urdf(text.encode(), "Trace.meta['urdf']"), "trace", feet=feet)


def _push(model: pin.Model, load: Mapping[str, Any]) -> RecordedPush:
    name, place = placement(model, load["link"])
    point, force, torque = (
        np.array(load.get(key, (0.0, 0.0, 0.0)), dtype=float)
        for key in ("position", "force", "torque")
    )
    start = float(load["start"])
    end = start + float(load["duration"])
    return RecordedPush(model.getJointId(name), place.act(point), force, torque, start, end)


def _contact_joints(trace: Trace, robot: Robot, feet: Sequence[str]) -> tuple[int, ...]:
    """Return the joints that move the contact points: the feet, and after them the trunk's."""
    if trace.foot_names[: len(feet)] != tuple(feet):
        raise ParameterError("Trace.foot_names", trace.foot_names, f"those of the scene: {feet}")
    joints = [robot.model.getJointId(robot.foot(name).joint) for name in feet]
    return (*joints, *[TRUNK_JOINT] * (len(trace.foot_names) - len(feet)))


def _drives(robot: Robot, scene: Mapping[str, Any]) -> tuple[Array, Array]:
    """Return damping and armature of the joints, of URDF and motors."""
    damping, armature = np.array(robot.damping), np.zeros(len(robot.joint_names))
    if "servo" not in scene:
        return damping, armature
    for j, motor in enumerate(Servo(**scene["servo"]).motors(robot)):
        if motor is not None:
            damping[j] += motor.viscous_friction
            armature[j] = motor.armature
    return damping, armature
