"""A scene joins robot, ground, contact, drives, gravity and loads; it has a TOML form."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import digest
from hexapod_pin.drive.drive_law import has_dry_friction
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.motor import MOTORS_SHARE, most_torque, unit_meant
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError
from hexapod_pin.file_schema import check_data
from hexapod_pin.ground.contact import Contact
from hexapod_pin.ground.terrain import AnyTerrain, Flat, Plane
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.link_shapes import trunk_points
from hexapod_pin.robot.robot import Robot, once_per_robot, scratch_data
from hexapod_pin.scene.canonical_text import TEXTS, canonical_text, joined
from hexapod_pin.scene.loaded_model import models_by_mass
from hexapod_pin.scene.loads import (
    Load,
    LostLeg,
    MassLoad,
    Payload,
    RemovedMass,
    checked_loads,
)
from hexapod_pin.scene.robot_file import read_robot, robot_to_dict
from hexapod_pin.scene.settings import SceneSettings, SceneText
from hexapod_pin.shown import drawn
from hexapod_pin.spec import read_toml

if TYPE_CHECKING:
    import pinocchio as pin

    from hexapod_pin.arrays import Array
    from hexapod_pin.robot.state import State


USUAL_TORQUE = 15.0
"""Stall torque of all motors over the robot's mass [N m/kg]: which unit was meant.

Motors are some two fifths of a robot's mass, and have 37 N m/kg in the middle of the catalogue."""

SERVO_SPEED = 100.0
"""No-load speed from which a motor is an ideal one, whose torque may be anything [rad/s]."""


def _check_motors(scene: Scene) -> None:
    """Refuse motors whose torque is in another unit; robots with doubtful masses have any.

    Raises:
        ParameterError: as many motors of a stall torque as the robot has joints would weigh more
            than `MOTORS_SHARE` of it.
    """
    robot, servo = scene.robot, scene.servos
    if servo.motor is None or not robot.legs or robot.doubts:
        return
    mass = robot.total_mass
    mass += math.fsum(load.mass for load in scene.loads if isinstance(load, Payload))
    count = sum(len(leg.joints) for leg in robot.legs)
    most = most_torque(mass, count)
    for name, motor in zip(robot.joint_names, servo.motors(robot), strict=True):
        if motor is None or motor.no_load_speed > SERVO_SPEED:
            continue
        torque = motor.stall_torque
        if min(torque, motor.peak_torque or math.inf) <= most:
            continue
        allowed = (
            f"at most {most:.3g} N m: {count} stronger motors weigh more than {MOTORS_SHARE:g} "
            f"times the robot's {mass:.3g} kg"
        )
        meant, _ = unit_meant(torque, count * torque / mass, USUAL_TORQUE)
        hint = f"Perhaps it is {meant}."
        raise ParameterError(f"Scene.servo.motor[{name}].stall_torque", torque, allowed, hint)


@checked
@dataclass(frozen=True, eq=False)
class Scene(Immutable):
    """Everything a simulation needs besides a controller. Two are equal when they mean the same.

    The robot counts with its file's content and with its feet and posture, as in a `Case`.

    Attributes:
        robot: the robot.
        terrain: the ground.
        contact: laws between feet and ground; default `Contact.accurate()`, *assumed* numbers.
        servo: joint servos; default `Servo.for_robot(robot)`, *assumed* gains.
        gravity: acceleration [m/s^2], world axes; tilt it to stand on a slope.
        stops: what holds the joints in their range; default `JointStops.for_robot(robot)`,
            *assumed* numbers.
        loads: payloads, pushes and lost legs.
        body_contact: whether the ground pushes the trunk's corners (`trunk_points`) as it pushes
            the feet; without it the trunk passes through, which is reported.
        prescribed: whether the joints follow their set-points exactly, as ADAMS motions do ([S2]):
            only the base's six equations are integrated, and the joint torques are what inverse
            dynamics with the foot forces gives. No servo, torque limit or joint stop acts.
    """

    robot: Robot
    terrain: AnyTerrain = field(default_factory=Flat)
    contact: Contact = field(default_factory=Contact.accurate)
    servo: Servo | None = None
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    stops: JointStops | None = None
    loads: Sequence[Load] = ()
    body_contact: bool = False
    prescribed: bool = False

    def __post_init__(self) -> None:
        """Fill in the default servo and stops; check gravity, loads and body contact.

        Raises:
            ParameterError: gravity is not three finite numbers, `loads` holds something else, more
                mass is removed from a link than it has, the trunk for body contact has no known
                shape, or a leg is to be lost whose joints follow a motion.
            ParameterError: such motors would weigh more than `MOTORS_SHARE` of the robot.
            UnknownNameError: a load on a link or leg that the robot does not have.
        """
        if self.servo is None:
            object.__setattr__(self, "servo", Servo.for_robot(self.robot))
        if self.stops is None:
            object.__setattr__(self, "stops", JointStops.for_robot(self.robot))
        gravity = tuple(float(g) for g in self.gravity)
        if len(gravity) != 3 or not all(math.isfinite(g) for g in gravity):
            raise ParameterError("Scene.gravity", self.gravity, "three finite numbers [m/s^2]")
        object.__setattr__(self, "gravity", gravity)
        object.__setattr__(self, "loads", checked_loads(self.robot, self.loads))
        if any(isinstance(load, RemovedMass) for load in self.loads):
            loaded_model(self)  # refuses masses that the links do not have
        if self.body_contact and not len(trunk_points(self.robot)):
            raise ParameterError(
                "Scene.body_contact", True, f"False: the trunk of {self.robot.name} has no shape",
                "Give its base link collision shapes.",
            )  # fmt: skip
        _check_motors(self)
        if self.prescribed and any(isinstance(load, LostLeg) for load in self.loads):
            raise ParameterError(
                "Scene.prescribed", True, "False with a LostLeg",
                "Joints that follow a motion cannot lose their torque.",
            )  # fmt: skip

    def __eq__(self, other: object) -> bool:
        """Return whether both mean the same."""
        return isinstance(other, Scene) and (self is other or self._meaning == other._meaning)

    def __hash__(self) -> int:
        """Return a hash of what the scene means."""
        return hash(self._meaning)

    @cached_property
    def _meaning(self) -> str:
        return digest(scene_text(self))

    def _repr_html_(self) -> str:
        """Return what a notebook shows: its laws, and the robot standing on its ground."""
        return str(drawn("notebook_html", self))

    @property
    def servos(self) -> Servo:
        """The joint servos (never None)."""
        return self.servo or Servo.for_robot(self.robot)

    @property
    def joint_stops(self) -> JointStops:
        """What holds the joints in their range (never None)."""
        return self.stops or JointStops.for_robot(self.robot)

    @cached_property
    def settings(self) -> SceneSettings:
        """All but the robot, with nothing left to a default."""
        return SceneSettings(
            self.terrain, self.contact, self.servos, self.joint_stops, self.gravity,
            tuple(self.loads), self.body_contact, self.prescribed,
        )  # fmt: skip

    @property
    def mass_loads(self) -> tuple[MassLoad, ...]:
        """The loads that change masses, in their order."""
        return self.settings.mass_loads

    @property
    def total_mass(self) -> float:
        """Mass of the robot with its loads [kg]."""
        if not all(isinstance(load, Payload) for load in self.mass_loads):
            return math.fsum(body.mass for body in loaded_model(self).inertias)
        return math.fsum([self.robot.total_mass, *(load.mass for load in self.payloads)])

    @property
    def payloads(self) -> tuple[Payload, ...]:
        """The bodies that the robot carries, in their order."""
        return self.settings.payloads

    def require_unloaded(self, where: str) -> None:
        """Refuse loads, body contact and prescribed motion where they cannot be done.

        Raises:
            ParameterError: the scene has some; `where` names what does not support them.
        """
        if self.loads:
            kinds = ", ".join(sorted({load.kind for load in self.loads}))
            raise ParameterError("Scene.loads", kinds, f"empty {where}")
        if self.body_contact:
            raise ParameterError("Scene.body_contact", True, f"False {where}")
        if self.prescribed:
            raise ParameterError("Scene.prescribed", True, f"False {where}")

    @property
    def sensitive(self) -> bool:
        """Whether small errors may turn a motion into another.

        Nothing damps what they do to the velocities of a body without joints; and where friction
        jumps, any of them may decide whether a foot that comes to rest sticks.
        """
        return not self.robot.joint_names or self.contact.friction.jumps

    @property
    def carries_errors(self) -> bool:
        """Whether a run can carry its own error along, as far as the scene shows.

        Not where joints follow a motion, drives have dry friction, or the scene is `sensitive`.
        """
        if self.prescribed or self.sensitive:
            return False
        return not has_dry_friction(self.robot, self.servos)

    @property
    def assumed(self) -> tuple[str, ...]:
        """Statements of every number in this scene that no source gives."""
        found = list(self.robot.assumed)
        if self.contact.assumed:
            found.append(f"contact: {self.contact.assumed}")
        if self.servos.assumed and not self.prescribed:
            rule = "" if self.servos.rule is None else f" ({self.servos.rule})"
            found.append(f"servo gains: {self.servos.describe()}{rule}")
        stops = self.joint_stops.assumed and self.joint_stops.stiffnesses(self.robot).any()
        if stops and not self.prescribed:
            found.append(f"joint stops: {self.joint_stops.describe()}")
        found += [
            f"payload of {load.mass:g} kg on {load.link}: a point mass"
            for load in self.payloads
            if load.inertia is None
        ]
        if self.body_contact and (assumed := trunk_points(self.robot).assumed):
            found.append(f"body contact: {assumed}")
        return tuple(found)

    def to_dict(self) -> dict[str, Any]:
        """Return the TOML-able form."""
        return self.settings.with_robot(robot_to_dict(self.robot))

    def to_toml(self) -> str:
        """Return the scene as TOML text."""
        return self._toml

    @cached_property
    def _toml(self) -> str:
        import tomli_w

        return tomli_w.dumps(self.to_dict())

    @classmethod
    @checked
    def from_toml(cls, text: str) -> Scene:
        """Rebuild a scene from its TOML text; the robot is loaded again from its source.

        Raises:
            ParameterError: bad TOML, a missing or unknown key, a value of a wrong type or out of
                range, or a robot file that has changed since the text was written.
            UnknownNameError: a load on a link or leg that the robot does not have.
            UrdfError: the robot's file is no longer usable.
        """
        return cls(**scene_parts(read_toml(text)))


def scene_parts(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of the `Scene` that `to_dict` turned into plain data.

    Raises:
        ParameterError, UnknownNameError, UrdfError: as `Scene.from_toml`.
    """
    check_data(SceneText, "scene", data)
    robot = read_robot(data["robot"])
    settings = SceneSettings.from_dict(data)
    return {
        "robot": robot,
        **{field.name: getattr(settings, field.name) for field in fields(settings)},
    }


def scene_text(scene: Scene) -> str:
    """Return the text of `Scene.to_dict`; of the robot what its file and options lead to."""
    settings = scene.settings
    parts = {name: canonical_text(value) for name, value in settings.plain.items()}
    parts["robot"] = _robot_text(scene.robot)
    for name, law in settings.laws.items():
        parts[name] = TEXTS.of(law, lambda x: canonical_text(x.model_dump()))
    return joined(parts)


@once_per_robot
def _robot_text(robot: Robot) -> str:
    data = robot_to_dict(robot)
    for where in ("source", "options"):  # the robot's digest covers what they lead to
        data.pop(where, None)
    return canonical_text(data)


@checked
def loaded_model(scene: Scene) -> pin.Model:
    """Return the robot's model with the masses of the scene: payloads on, factors, masses removed.

    The robot's own model where the scene changes no mass. Must not be changed.
    """
    return models_by_mass(scene.robot)(scene.mass_loads)


def standing_on(scene: Scene, posture: Array, start_pose: Array | None = None) -> State:
    """Return the state at rest in a posture (n,) [rad], just touching the ground.

    On a plane the robot is laid along it; on any other ground it stands level.

    Args:
        scene: the robot and its ground.
        posture: joint angles, `Robot.joint_names` order [rad]. Shape (n,).
        start_pose: of the trunk, relative to the plane or to the level: x, y [m], z (not used: the
            feet decide), quaternion x, y, z, w; None: no offset. Shape (7,).
    """
    import pinocchio as pin

    robot, surface = scene.robot, scene.terrain.surface()
    q = robot.stand(posture).q.copy()
    if start_pose is not None:
        q[:2], q[3:7] = start_pose[:2], start_pose[3:7]
    if isinstance(surface, Plane):
        tilt = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), np.array(surface.normal))
        own = pin.Quaternion(*q[[6, 3, 4, 5]])
        turned = tilt if start_pose is None else tilt * own
        q[:3], q[3:7] = tilt.toRotationMatrix() @ q[:3], turned.coeffs()
    if robot.feet:
        data = scratch_data(robot)
        pin.forwardKinematics(robot.model, data, q)
        joints = [robot.model.getJointId(foot.joint) for foot in robot.feet]
        feet = zip(joints, robot.feet, strict=True)
        centers = [data.oMi[joint].act(foot.offset) for joint, foot in feet]
        q[2] += scene.terrain.lift(centers, [foot.radius for foot in robot.feet])
    return robot.check_state(q, np.zeros(robot.model.nv))
