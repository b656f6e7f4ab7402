"""Servos whose motor and gear were identified from recordings, beside what their makers publish."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from types import MappingProxyType
from typing import TYPE_CHECKING

from hexapod_pin.arguments import checked
from hexapod_pin.drive.gear_friction import GearFriction
from hexapod_pin.drive.motor import Motor
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.immutable import Immutable
from hexapod_pin.spec import require_factor

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hexapod_pin.drive.catalog.motor_record import MotorRecord

PACKAGE_FILE = "identified.csv"


@dataclass(frozen=True)
class IdentifiedDrive(Immutable):
    """A servo's motor and gear as fitted to recordings; all at the joint.

    Attributes:
        model: name of the servo.
        form: of the friction, "M1" to "M6" (see `GearFriction`).
        torque_constant: k, torque over current and voltage over speed [N m/A].
        resistance: R, of the winding and the driver [ohm].
        armature: of the rotor, with the square of the gear's ratio [kg m^2].
        viscous: friction in proportion to the speed [N m s/rad].
        gear: the rest of the friction.
        source: where the numbers are published.
    """

    model: str
    form: str
    torque_constant: float
    resistance: float
    armature: float
    viscous: float
    gear: GearFriction
    source: str

    @checked
    def motor(self, supply: float) -> Motor:
        """Return the motor for a servo at a supply voltage [V].

        Its line is the motor's own, from k U / R at rest to U / k: friction comes off it. That of a
        data sheet has friction in it already, so the two must not be mixed.

        Raises:
            ParameterError: the voltage is not positive and finite.
        """
        volts = require_factor(supply, "supply")
        return Motor(
            stall_torque=self.torque_constant * volts / self.resistance,
            no_load_speed=volts / self.torque_constant,
            rotor_inertia=self.armature,
            viscous_friction=self.viscous,
            gear_friction=self.gear,
            torque_constant=self.torque_constant,
            winding_resistance=self.resistance,
        )


@lru_cache(maxsize=1)
def identified_drives() -> Mapping[str, IdentifiedDrive]:
    """Return the identified servos of the package by name."""
    text = resources.files(__package__).joinpath(PACKAGE_FILE).read_text(encoding="utf-8")
    found = {row["model"]: _drive(row) for row in csv.DictReader(text.splitlines())}
    return MappingProxyType(found)


@checked
def identified_drive(model: str) -> IdentifiedDrive:
    """Return an identified servo by its name, such as "MX-64".

    Raises:
        UnknownNameError: no identified servo has this name.
    """
    known = identified_drives()
    for name, drive in known.items():
        if name.casefold() == model.casefold():
            return drive
    raise UnknownNameError("identified servo", model, list(known))


def identified_for(record: MotorRecord) -> IdentifiedDrive | None:
    """Return the identified servo of a catalogue's row, by its model or its name with a voltage."""
    known = identified_drives()
    return known.get(record.model) or known.get(record.name)


def _drive(row: Mapping[str, str]) -> IdentifiedDrive:
    number = {name: float(cell) for name, cell in row.items() if name not in TEXTS}
    by_field = {_field(name): value for name, value in number.items()}
    gear = {name: by_field[name] for name in GearFriction.model_fields if name in by_field}
    return IdentifiedDrive(
        model=row["model"], form=row["form"], source=row["source"],
        torque_constant=number["torque_constant_Nm_A"], resistance=number["resistance_ohm"],
        armature=number["armature_kgm2"], viscous=number["viscous_Nms"],
        gear=GearFriction(**gear, external_load=True),  # as BAM identifies them
    )  # fmt: skip


TEXTS = ("model", "form", "source")


def _field(column: str) -> str:
    """Return a column's name without its unit."""
    for unit in ("_per_Nm", "_rad_s", "_Nm"):
        column = column.removesuffix(unit)
    return column
