"""The settings of a scene besides its robot, and their TOML form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.servo import Servo
from hexapod_pin.file_schema import FileData, Number, check_data
from hexapod_pin.ground.contact import Contact
from hexapod_pin.ground.contact.contact import read_contact
from hexapod_pin.ground.terrain import AnyTerrain, read_terrain
from hexapod_pin.immutable import Immutable
from hexapod_pin.scene.loads import (
    Load,
    MassFactor,
    MassLoad,
    Payload,
    RemovedMass,
    load_to_dict,
    read_loads,
)
from hexapod_pin.spec import Spec

SCHEMA = 1


@dataclass(frozen=True, eq=False)
class SceneSettings(Immutable):
    """The settings of a scene besides its robot; a run stores them, without the robot's file.

    Attributes:
        terrain: the ground.
        contact: laws between feet and ground.
        servo: joint servos.
        stops: what holds the joints in their range.
        gravity: acceleration [m/s^2], world axes.
        loads: payloads, other masses, pushes and lost legs.
        body_contact: whether the ground pushes the trunk's corners.
        prescribed: whether the joints follow their set-points exactly.
    """

    terrain: AnyTerrain
    contact: Contact
    servo: Servo
    stops: JointStops | None
    gravity: tuple[float, float, float]
    loads: tuple[Load, ...] = ()
    body_contact: bool = False
    prescribed: bool = False

    @cached_property
    def mass_loads(self) -> tuple[MassLoad, ...]:
        """The loads that change masses, in their order."""
        kinds = (Payload, MassFactor, RemovedMass)
        return tuple(load for load in self.loads if isinstance(load, kinds))

    @property
    def payloads(self) -> tuple[Payload, ...]:
        """The bodies that the robot carries, in their order."""
        return tuple(load for load in self.loads if isinstance(load, Payload))

    @property
    def laws(self) -> dict[str, Spec]:
        """Terrain, contact, servos and stops by their names in `to_dict`."""
        found: dict[str, Spec | None] = {
            "terrain": self.terrain,
            "contact": self.contact,
            "servo": self.servo,
            "stops": self.stops,
        }
        return {name: law for name, law in found.items() if law is not None}

    @property
    def plain(self) -> dict[str, Any]:
        """The TOML-able form of what is no law."""
        data: dict[str, Any] = {"schema": SCHEMA, "gravity": list(self.gravity)}
        if self.loads:
            data["loads"] = [load_to_dict(load) for load in self.loads]
        if self.body_contact:
            data["body_contact"] = True
        if self.prescribed:
            data["prescribed"] = True
        return data

    def with_robot(self, robot: Mapping[str, Any]) -> dict[str, Any]:
        """Return the TOML-able form of the scene, with that of its robot (`robot_to_dict`)."""
        rest = self.plain
        first = {name: rest.pop(name) for name in ("schema", "gravity")}
        laws = {name: law.model_dump() for name, law in self.laws.items()}
        return {**first, "robot": dict(robot), **laws, **rest}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> SceneSettings:
        """Return the settings of a scene's TOML-able form; its robot is not read.

        Raises:
            ParameterError: a missing or unknown key, or a value of a wrong type or out of range.
        """
        check_data(SceneText, "scene", data)
        return cls(
            terrain=read_terrain(data["terrain"]),
            contact=read_contact(data["contact"]),
            servo=Servo(**data["servo"]),
            stops=JointStops(**data["stops"]) if "stops" in data else None,
            gravity=tuple(data["gravity"]),
            loads=tuple(read_loads(data.get("loads", ()))),
            body_contact=data.get("body_contact", False),
            prescribed=data.get("prescribed", False),
        )


class SceneText(FileData):
    """What the TOML text of a scene must be; its tables are checked by what they describe."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)

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
