"""A scene: a robot, its servos, its ground and the contact between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact import Contact
from hexapod_pin.ground.terrain import AnyTerrain, Flat, read_terrain
from hexapod_pin.spec import read_toml

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

SCHEMA = 1


@dataclass(frozen=True)
class Scene:
    """Everything a simulation needs besides a controller.

    Attributes:
        robot: the robot.
        terrain: the ground.
        contact: laws between feet and ground; default `Contact.accurate()`, *assumed* numbers.
        servo: joint servos; default `Servo.from_effort(robot)`, *assumed* gains.
        gravity: acceleration [m/s^2], world axes; tilt it to stand on a slope.
        stops: what holds the joints in their range; default `JointStops.from_effort(robot)`,
            *assumed* numbers.
    """

    robot: Robot
    terrain: AnyTerrain = field(default_factory=Flat)
    contact: Contact = field(default_factory=Contact.accurate)
    servo: Servo | None = None
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    stops: JointStops | None = None

    def __post_init__(self) -> None:
        """Fill in the default servo and stops, and check gravity.

        Raises:
            ParameterError: if gravity is not three finite numbers.
        """
        if self.servo is None:
            object.__setattr__(self, "servo", Servo.from_effort(self.robot))
        if self.stops is None:
            object.__setattr__(self, "stops", JointStops.from_effort(self.robot))
        gravity = tuple(float(g) for g in self.gravity)
        if len(gravity) != 3 or not all(math.isfinite(g) for g in gravity):
            raise ParameterError("Scene.gravity", self.gravity, "three finite numbers [m/s^2]")
        object.__setattr__(self, "gravity", gravity)

    @property
    def servos(self) -> Servo:
        """The joint servos (never None)."""
        return self.servo or Servo.from_effort(self.robot)

    @property
    def joint_stops(self) -> JointStops:
        """What holds the joints in their range (never None)."""
        return self.stops or JointStops.from_effort(self.robot)

    @property
    def assumed(self) -> tuple[str, ...]:
        """Statements of every number in this scene that no source gives."""
        found = list(self.robot.assumed)
        if self.contact.assumed:
            found.append(f"contact: {self.contact.assumed}")
        if self.servos.assumed:
            found.append(f"servo gains: {self.servos.describe()}")
        if self.joint_stops.assumed and self.joint_stops.stiffness > 0.0:
            found.append(
                f"joint stops: {self.joint_stops.stiffness:g} N m/rad, "
                f"{self.joint_stops.dissipation:g} s/rad"
            )
        return tuple(found)

    def to_dict(self) -> dict[str, Any]:
        """Return the TOML-able form."""
        robot = {
            "source": self.robot.source,
            "feet": [foot.name for foot in self.robot.feet],
            "digest": self.robot.digest,
        }
        return {
            "schema": SCHEMA,
            "gravity": list(self.gravity),
            "robot": robot,
            "terrain": self.terrain.model_dump(),
            "contact": self.contact.model_dump(),
            "servo": self.servos.model_dump(),
            "stops": self.joint_stops.model_dump(),
        }

    def to_toml(self) -> str:
        """Return the scene as TOML text."""
        return self._toml

    @cached_property
    def _toml(self) -> str:
        import tomli_w

        return tomli_w.dumps(self.to_dict())

    @classmethod
    def from_toml(cls, text: str) -> Scene:
        """Rebuild a scene from its TOML text; the robot is loaded again from its source.

        Raises:
            ParameterError: bad TOML, a missing part, a value out of range, or a robot file that
                has changed since the text was written.
            UrdfError: the robot's file is no longer usable.
        """
        from hexapod_pin.robot.robot import load_robot

        data = read_toml(text, required=("robot", "terrain", "contact", "servo", "gravity"))
        robot = load_robot(data["robot"]["source"], feet=data["robot"].get("feet"))
        if data["robot"].get("digest", robot.digest) != robot.digest:
            raise ParameterError(
                "robot.digest", data["robot"]["digest"], "that of the file", "The URDF has changed."
            )
        return cls(
            robot,
            terrain=read_terrain(data["terrain"]),
            contact=Contact(**data["contact"]),
            servo=Servo(**data["servo"]),
            gravity=tuple(data["gravity"]),
            stops=JointStops(**data["stops"]) if "stops" in data else None,
        )
