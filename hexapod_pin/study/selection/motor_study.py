"""The file of a motor selection: the walks of a sweep study, and what motors may be chosen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import NonNegativeFloat, PositiveFloat, Strict

from hexapod_pin.drive.catalog import Catalog, MotorRecord, load_catalog
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.spec import Spec, read_toml
from hexapod_pin.study.sweep.fields import read_spec, table_at

Positive = Annotated[PositiveFloat, Strict()]
NotNegative = Annotated[NonNegativeFloat, Strict()]

PAYLOAD_SHARE = 0.1
"""Payload over the robot's mass where no walks are given (*assumed*)."""


class MotorChoice(Spec):
    """Which motors may be chosen; what is left out does not restrict.

    Attributes:
        catalog: path of a user's file; None: the package's.
        makers: names of makers, in capitals or not.
        models: names of models.
        buses: names of buses, such as "TTL": motors that can be had with one of them.
        voltage: of the battery [V]: rows of that voltage alone.
        heaviest: largest mass of a motor [kg].
        dearest: largest price of a motor, in the catalogue's currency.
        motor_mass: of each motor that the robot's file contains [kg]; None: *assumed*, 35 % of the
            robot's mass in all.
    """

    catalog: str | None = None
    makers: tuple[str, ...] = ()
    models: tuple[str, ...] = ()
    buses: tuple[str, ...] = ()
    voltage: Positive | None = None
    heaviest: Positive | None = None
    dearest: Positive | None = None
    motor_mass: NotNegative | None = None


@dataclass(frozen=True)
class Candidates:
    """Motors to choose from.

    Attributes:
        records: those that can be compared with a line.
        unusable: name and reason of those that cannot.
        source: of the catalogue.
    """

    records: tuple[MotorRecord, ...]
    unusable: tuple[tuple[str, str], ...]
    source: str


def candidates(choice: MotorChoice, folder: Path) -> Candidates:
    """Return the motors of the catalogue that a choice allows.

    Raises:
        CatalogError: the file is not usable.
        UnknownNameError: a maker, bus or model that is not there.
        ParameterError: none is left.
    """
    catalog = load_catalog(None if choice.catalog is None else folder / choice.catalog)
    _refuse_unknown("maker", choice.makers, [record.maker for record in catalog if record.maker])
    _refuse_unknown("bus", choice.buses, [name for record in catalog for name in record.buses])
    _refuse_unknown("motor", choice.models, [record.model for record in catalog])
    rows = catalog if choice.voltage is None else catalog.at(choice.voltage)
    allowed = [record for record in rows if _allows(choice, record)]
    good = tuple(record for record in allowed if record.unusable is None)
    if not good:
        raise ParameterError(
            "motors", choice.model_dump(exclude_none=True), "a choice that leaves a motor",
            f"{len(catalog)} motors are in {catalog.source}, {_priced(catalog)} of them with a "
            f"price; voltages: {_voltages(catalog)}.",
        )  # fmt: skip
    bad = tuple((record.name, str(record.unusable)) for record in allowed if record.unusable)
    return Candidates(good, bad, catalog.source)


def _allows(choice: MotorChoice, record: MotorRecord) -> bool:
    if choice.makers and record.maker.casefold() not in map(str.casefold, choice.makers):
        return False
    buses = {name.casefold() for name in record.buses}
    if choice.buses and buses.isdisjoint(map(str.casefold, choice.buses)):
        return False
    if choice.models and record.model not in choice.models:
        return False
    if choice.heaviest is not None and (record.mass is None or record.mass > choice.heaviest):
        return False
    return choice.dearest is None or (record.price is not None and record.price <= choice.dearest)


def _refuse_unknown(kind: str, names: tuple[str, ...], known: list[str]) -> None:
    exact = kind == "motor"
    listed = set(known) if exact else {one.casefold() for one in known}
    for name in names:
        if (name if exact else name.casefold()) not in listed:
            raise UnknownNameError(kind, name, sorted(set(known)))


def _priced(catalog: Catalog) -> int:
    return sum(record.price is not None for record in catalog)


def _voltages(catalog: Catalog) -> str:
    return ", ".join(f"{volts:g} V" for volts in sorted({r.voltage for r in catalog}))


@dataclass(frozen=True)
class MotorStudyFile:
    """A file taken apart.

    Attributes:
        choice: which motors may be chosen.
        derating: the fraction of their limits that may be used.
        sweep: the tables of the sweep study in it: schema, name, base, vary, design.
    """

    choice: MotorChoice
    derating: Derating
    sweep: Mapping[str, Any]


def read_motor_study(text: str) -> MotorStudyFile:
    """Return the tables of a file; those of the sweep are checked when its cases are made.

    Raises:
        ParameterError: bad syntax, or a value out of range, with its path in the file.
    """
    data = read_toml(text)
    motors = read_spec(MotorChoice, table_at(data.pop("motors", {}), "motors"), "motors")
    derating = read_spec(Derating, table_at(data.pop("derating", {}), "derating"), "derating")
    return MotorStudyFile(motors, derating, data)


def default_study(source: str, gaits: Sequence[str], mass: float) -> str:
    """Return the text of a study where only a robot is given.

    Args:
        source: name of the robot, or the path of its file.
        gaits: names of gaits.
        mass: of the robot [kg].
    """
    import tomli_w

    payloads = [0.0, float(f"{PAYLOAD_SHARE * mass:.2g}")]
    return tomli_w.dumps(
        {
            "schema": 1,
            "name": f"motors for {Path(source).stem}",
            "base": {"robot": source, "accuracy": 1e-4},
            "vary": [
                {"input": "gait", "values": list(gaits)},
                {"input": "payload", "values": payloads},
            ],
        }
    )
