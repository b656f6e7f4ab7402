"""A scene joins robot, ground, contact, drives, gravity and loads; it has a TOML form."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import digest
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError
from hexapod_pin.file_schema import FileData, Number, check_data
from hexapod_pin.ground.contact import Contact
from hexapod_pin.ground.terrain import AnyTerrain, Flat, read_terrain
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.link_shapes import trunk_points
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.robot.robot import PACKAGED, Robot, load_robot, urdf_path
from hexapod_pin.simulation.loads import (
    Load,
    LostLeg,
    MassFactor,
    MassLoad,
    Payload,
    RemovedMass,
    checked_loads,
    load_to_dict,
    read_loads,
)
from hexapod_pin.spec import Spec, read_toml
from hexapod_pin.user_file import user_path

SCHEMA = 1


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
            the feet; without it the trunk passes through, which is noticed and told.
        prescribed: whether the joints follow their set-points exactly, as ADAMS motions do ([S2]):
            only the base's six equations are integrated, and the joint torques are what inverse
            dynamics with the foot forces says. No servo, torque limit or joint stop acts.
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
                mass is removed from a link than it has, body
                contact is wanted of a trunk whose shape is not known, or a leg is to be lost whose
                joints follow a motion.
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
            self._require_possible_masses()
        for name in ("body_contact", "prescribed"):
            if not isinstance(getattr(self, name), bool):
                raise ParameterError(f"Scene.{name}", getattr(self, name), "true or false")
        if self.body_contact and not len(trunk_points(self.robot)):
            raise ParameterError(
                "Scene.body_contact", True, f"False: the trunk of {self.robot.name} has no shape",
                "Give its base link collision shapes.",
            )  # fmt: skip
        if self.prescribed and any(isinstance(load, LostLeg) for load in self.loads):
            raise ParameterError(
                "Scene.prescribed", True, "False with a LostLeg",
                "Joints that follow a motion cannot lose their torque.",
            )  # fmt: skip

    def __eq__(self, other: object) -> bool:
        """Tell whether both mean the same."""
        return isinstance(other, Scene) and (self is other or self._meaning == other._meaning)

    def __hash__(self) -> int:
        """Return a hash of what the scene means."""
        return hash(self._meaning)

    @cached_property
    def _meaning(self) -> str:
        from hexapod_pin.simulation.case_data import scene_text

        return digest(scene_text(self))

    @property
    def servos(self) -> Servo:
        """The joint servos (never None)."""
        return self.servo or Servo.for_robot(self.robot)

    @property
    def joint_stops(self) -> JointStops:
        """What holds the joints in their range (never None)."""
        return self.stops or JointStops.for_robot(self.robot)

    def _require_possible_masses(self) -> None:
        """Refuse masses removed that the links do not have."""
        from hexapod_pin.simulation.loaded_model import loaded_model

        loaded_model(self)

    @cached_property
    def mass_loads(self) -> tuple[MassLoad, ...]:
        """The loads that change masses, in their order."""
        kinds = (Payload, MassFactor, RemovedMass)
        return tuple(load for load in self.loads if isinstance(load, kinds))

    @property
    def total_mass(self) -> float:
        """Mass of the robot with its loads [kg]."""
        if not all(isinstance(load, Payload) for load in self.mass_loads):
            from hexapod_pin.simulation.loaded_model import loaded_model

            return math.fsum(body.mass for body in loaded_model(self).inertias)
        return math.fsum([self.robot.total_mass, *(load.mass for load in self.payloads)])

    @property
    def payloads(self) -> tuple[Payload, ...]:
        """The bodies that the robot carries, in their order."""
        return tuple(load for load in self.loads if isinstance(load, Payload))

    def require_unloaded(self, where: str) -> None:
        """Refuse loads, body contact and prescribed motion where they cannot be done.

        Raises:
            ParameterError: the scene has some; `where` says what cannot do them.
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
        laws = {name: law.model_dump() for name, law in self.laws().items()}
        rest = self.settings_to_dict()
        first = {name: rest.pop(name) for name in ("schema", "gravity")}
        return {**first, "robot": robot_to_dict(self.robot), **laws, **rest}

    def laws(self) -> dict[str, Spec]:
        """Return terrain, contact, servos and stops by their names in `to_dict`."""
        return {
            "terrain": self.terrain,
            "contact": self.contact,
            "servo": self.servos,
            "stops": self.joint_stops,
        }

    def settings_to_dict(self) -> dict[str, Any]:
        """Return the TOML-able form of all but the robot and the laws."""
        data: dict[str, Any] = {"schema": SCHEMA, "gravity": list(self.gravity)}
        if self.loads:
            data["loads"] = [load_to_dict(load) for load in self.loads]
        if self.body_contact:
            data["body_contact"] = True
        if self.prescribed:
            data["prescribed"] = True
        return data

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


class SceneText(FileData):
    """What the TOML text of a scene must be; its tables are checked by what they describe."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    version: Literal[1] = Field(default=1, alias="schema")
    robot: dict[str, Any]
    terrain: dict[str, Any]
    contact: dict[str, Any]
    servo: dict[str, Any]
    gravity: Annotated[list[Number], Field(min_length=3, max_length=3)]
    stops: dict[str, Any] | None = None
    loads: list[dict[str, Any]] = Field(default_factory=list)
    body_contact: bool = False
    prescribed: bool = False


def scene_parts(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of the `Scene` that `to_dict` turned into plain data.

    Raises:
        ParameterError, UnknownNameError, UrdfError: as `Scene.from_toml`.
    """
    check_data(SceneText, "scene", data)
    parts = {name: data[name] for name in ("body_contact", "prescribed") if name in data}
    return {
        "robot": read_robot(data["robot"]),
        "terrain": read_terrain(data["terrain"]),
        "contact": Contact(**data["contact"]),
        "servo": Servo(**data["servo"]),
        "gravity": tuple(data["gravity"]),
        "stops": JointStops(**data["stops"]) if "stops" in data else None,
        "loads": read_loads(data.get("loads", ())),
        **parts,
    }


# A robot as plain data: where its file is, what it contained, and how it was loaded.

OPTIONS = ("feet", "foot_radius", "posture")
"""What a robot was loaded with."""

KEPT_ROBOTS = 16
"""How many loaded robots are remembered."""


class RobotText(FileData):
    """What `robot_to_dict` returns, and what is written like it."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    source: str
    feet: list[str] | None = None
    foot_radius: list[Number] | Number | None = None
    posture: list[Number] | None = None
    digest: str | None = None
    options: dict[str, Any] | None = None


def robot_to_dict(robot: Robot) -> dict[str, Any]:
    """Return what `read_robot` takes; a path is absolute."""
    packaged = robot.source in PACKAGED
    explicit = robot.inferred or robot.mended or set(robot.options) - set(OPTIONS)
    options = {"options": dict(robot.options)} if explicit else {}
    return {
        "source": robot.source if packaged else str(user_path(robot.source).absolute()),
        "feet": [foot.name for foot in robot.feet],
        "foot_radius": [float(foot.radius) for foot in robot.feet],
        "posture": robot.posture.tolist(),
        "digest": robot.digest,
        **options,
    }


def read_robot(data: Mapping[str, Any]) -> Robot:
    """Load a robot again, with the foot radius and the posture that it was loaded with.

    The same file, unchanged, and the same options give the same object: cases share it.

    Raises:
        ParameterError: the file has changed, or does not give such feet.
        UrdfError: the file is not usable.
        UnknownNameError: there is no such robot.
    """
    check_data(RobotText, "robot", data)
    source = data["source"]
    if "options" in data:
        LoadOptions(**data["options"])  # refused by its name, before it is a part of a key
    parts = (tuple(x) if isinstance(x := data.get(name), list) else x for name in OPTIONS)
    options = json.dumps(data["options"], sort_keys=True) if "options" in data else None
    robot = _loaded(source, _stamp(source), *parts, options)
    if data.get("digest", robot.digest) != robot.digest:
        raise ParameterError(
            "robot.digest", data["digest"], "that of the file", "The URDF has changed."
        )
    return robot


def _stamp(source: str) -> tuple[int, int]:
    """Return what tells that a file has changed: time and size."""
    try:
        found = (urdf_path(source) if source in PACKAGED else user_path(source)).stat()
    except (OSError, ValueError):
        return (0, 0)  # loading it says what is wrong
    return (found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=KEPT_ROBOTS)
def _loaded(
    source: str,
    stamp: tuple[int, int],
    feet: Any,
    radii: Any,
    posture: Any,
    options_text: str | None,
) -> Robot:
    """Load a robot; `stamp` only tells one content of a file from another."""
    options = None if options_text is None else LoadOptions(**json.loads(options_text))
    given = feet if options is None else options.feet
    robot = load_robot(source, feet=given, options=options)
    changes: dict[str, Any] = {}
    if radii is not None and radii != _radii(robot):
        changes["foot_radius"] = radii[0] if isinstance(radii, tuple) and radii else radii
    if posture is not None and posture != tuple(robot.posture.tolist()):
        changes["posture"] = posture
    if changes:
        robot = load_robot(source, feet=given, options=options, **changes)
    if radii is not None and radii != _radii(robot):
        allowed = "the file's own, or one radius for all [m]"
        raise ParameterError("robot.foot_radius", radii, allowed)
    return robot


def _radii(robot: Robot) -> tuple[float, ...]:
    return tuple(float(foot.radius) for foot in robot.feet)
