"""A catalogue holds motors by name.

It is written as CSV with units in its columns, or as a Markdown table.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.drive.catalog.motor_record import MotorRecord
from hexapod_pin.errors import (
    CatalogError,
    CatalogFault,
    ParameterError,
    TraceFileError,
    UnknownNameError,
)
from hexapod_pin.foreign_text import csv_cell
from hexapod_pin.text_table import Table
from hexapod_pin.user_file import user_path

SAME_VOLTAGE = 1e-6
"""Relative difference up to which two voltages are the same [-]."""

USUAL_VOLTAGE = 12.0
"""Of the battery, where none is given [V], *assumed*: three lithium cells, nearly full."""


@checked
@dataclass(frozen=True)
class Catalog:
    """Motors, one record per model and voltage.

    Attributes:
        records: in the order of their file.
        source: the file they were read from.
    """

    records: tuple[MotorRecord, ...]
    source: str

    def __iter__(self) -> Iterator[MotorRecord]:
        """Iterate over the records."""
        return iter(self.records)

    def __contains__(self, record: object) -> bool:
        """Return whether it has a record."""
        return record in self.records

    def __len__(self) -> int:
        """Return the number of records."""
        return len(self.records)

    @property
    def models(self) -> tuple[str, ...]:
        """Names of the models, each once."""
        return tuple(dict.fromkeys(record.model for record in self.records))

    def get(self, model: str, voltage: float | None = None) -> MotorRecord:
        """Return the record of a model at a voltage.

        Args:
            model: its name, in capitals or not, or a record's whole `name`.
            voltage: [V]; None: that of the one record there is.

        Raises:
            UnknownNameError: there is no such model.
            ParameterError: no record has this voltage, or none is given and several have one.
        """
        found = self._of(model)
        fits = [r for r in found if voltage is None or _same(r.voltage, voltage)]
        if len(fits) == 1:
            return fits[0]
        raise ParameterError(
            "voltage", voltage, f"one of {_voltages(found)} V for {found[0].model}",
            f"Write {found[0].name!r}, or the like, for one of them.",
        )  # fmt: skip

    def usual(self, model: str, voltage: float | None = None) -> MotorRecord:
        """Return the record that a command takes: as `get`, and of several voltages that at 12 V.

        Raises:
            UnknownNameError, ParameterError: as of `get`; a model with several voltages has none
                at 12 V.
        """
        if voltage is None:
            found = self._of(model)
            usual = [record for record in found if _same(record.voltage, USUAL_VOLTAGE)]
            if len(found) > 1 and len(usual) == 1:
                return usual[0]
        return self.get(model, voltage)

    def at(self, voltage: float) -> tuple[MotorRecord, ...]:
        """Return the records of a voltage.

        Raises:
            ParameterError: there is none; names the voltages that there are.
        """
        found = tuple(record for record in self.records if _same(record.voltage, voltage))
        if not found:
            known = sorted({record.voltage for record in self.records})
            allowed = f"one of {', '.join(f'{volts:g}' for volts in known)} V"
            raise ParameterError("voltage", voltage, allowed)
        return found

    def supplied(self, model: str, voltage: float) -> tuple[MotorRecord, float]:
        """Return the record nearest to a supply voltage, and the supply over its voltage [-].

        Args:
            model: as of `get`.
            voltage: [V].

        Raises:
            UnknownNameError: there is no such model.
            ParameterError: the motor is not made for this supply.
        """
        found = self._of(model)
        nearest = min(found, key=lambda r: abs(r.voltage - voltage))
        low = min(r.voltage_min or r.voltage for r in found)
        high = max(r.voltage_max or r.voltage for r in found)
        if not low <= voltage <= high:
            allowed = (
                f"from {low:g} to {high:g} V for {nearest.model} (data at {_voltages(found)} V)"
            )
            raise ParameterError("voltage", voltage, allowed)
        return nearest, voltage / nearest.voltage

    def _of(self, model: str) -> list[MotorRecord]:
        wanted = model.strip().casefold()
        found = [r for r in self.records if wanted in (r.model.casefold(), r.name.casefold())]
        if not found:
            raise UnknownNameError("motor", model, list(self.models))
        return found

    def table(self) -> str:
        """Return the motors as a table in Markdown, one line per model."""
        return catalog_table(self.records)

    def save(self, path: str | Path) -> Path:
        """Write the catalogue as a file that `load_catalog` reads to the same records.

        Raises:
            CatalogError: the file cannot be written.
        """
        path = user_path(path)
        try:
            write_atomically(path, catalog_text(self.records))
        except TraceFileError as error:
            fault = CatalogFault(0, "", str(path), f"a file that can be written ({error})")
            raise CatalogError(str(path), [fault]) from error
        return path


def _same(one: float, other: float) -> bool:
    return abs(one - other) <= SAME_VOLTAGE * one


def _voltages(records: list[MotorRecord]) -> str:
    return ", ".join(f"{record.voltage:g}" for record in records)


# A catalogue as a table in Markdown, one line per model.

HEAD = (
    "model", "bus", "at [V]", "stall torque [N m]", "no-load speed [rad/s]", "rated torque [N m]",
    "mass [g]", "rotor at the joint [1e-3 kg m^2]", "price", "flags",
)  # fmt: skip


def catalog_table(records: Sequence[MotorRecord]) -> str:
    """Return the table; numbers of one model's voltages are separated by slashes.

    Rotor inertias that are estimated have a tilde before them.
    """
    models: dict[str, list[MotorRecord]] = {}
    for record in records:
        models.setdefault(record.model, []).append(record)
    rows = [_row(model, found) for model, found in models.items()]
    return Table("", HEAD, rows).markdown().rstrip("\n")


def _row(model: str, found: list[MotorRecord]) -> tuple[str, ...]:
    return (
        model,
        _each(found, lambda r: r.bus),
        _each(found, lambda r: f"{r.voltage:g}"),
        _each(found, lambda r: f"{r.stall_torque:.3g}"),
        _each(found, lambda r: _known(r.no_load_speed, 1.0)),
        _each(found, lambda r: _known(r.rated_torque, 1.0)),
        _each(found, lambda r: _known(r.mass, 1e3)),
        _each(found, _rotor),
        _each(found, lambda r: "" if r.price is None else f"{r.price:g} {r.currency}"),
        _flags(found),
    )


def _each(found: list[MotorRecord], text: Callable[[MotorRecord], str]) -> str:
    """Return the text of each record, or that of one where all are the same."""
    texts = [text(record) for record in found]
    return texts[0] if len(set(texts)) == 1 else " / ".join(texts)


def _known(value: float | None, factor: float) -> str:
    return "" if value is None else f"{factor * value:.3g}"


def _rotor(record: MotorRecord) -> str:
    if not record.joint_armature:
        return ""
    return f"{'~' if record.armature is None else ''}{1e3 * record.joint_armature:.2g}"


def _flags(found: list[MotorRecord]) -> str:
    """Return each flag in short, with its voltages where not all have it."""
    voltages: dict[str, list[str]] = {}
    for record in found:
        for flag in record.flags:
            short = flag.partition(":")[0].removesuffix(" is known")
            voltages.setdefault(short, []).append(f"{record.voltage:g}")
    return "; ".join(
        flag if len(of) == len(found) else f"{flag} at {', '.join(of)} V"
        for flag, of in voltages.items()
    )


# Write a file of motors that `load_catalog` reads back to the same records.


def catalog_text(records: tuple[MotorRecord, ...]) -> str:
    """Return the records as comma-separated values, in SI units with the units in the header."""
    out = io.StringIO(newline="")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([HEADERS[field][0] for field in ORDER])
    for record in records:
        writer.writerow([_cell(getattr(record, field)) for field in ORDER])
    return out.getvalue()


def _cell(value: str | float | None) -> str:
    """Return a cell's text; numbers with as many digits as their bits take."""
    if value is None:
        return ""
    if isinstance(value, str):
        return csv_cell(value)
    return repr(int(value)) if value == int(value) and abs(value) < 1e9 else repr(value)


# Columns of a file of motors: what each is called, and in which units it may stand.

KGF = 9.80665
"""Standard gravity: weight of a kilogram [N]."""

RPM = 2.0 * math.pi / 60.0
"""A turn per minute [rad/s]."""


class Column(NamedTuple):
    """A column of numbers.

    Attributes:
        field: of `MotorRecord`, in SI units (temperatures in deg C).
        units: ends of a header, with the factor to the field's unit; "" of a number without
            unit. The first is how the package writes it.
    """

    field: str
    units: dict[str, float]


TORQUE = {"Nm": 1.0, "mNm": 1e-3, "kgf_cm": 0.01 * KGF, "kgcm": 0.01 * KGF, "ozf_in": 0.00706155}
SPEED = {"rad_s": 1.0, "rpm": RPM, "deg_s": math.pi / 180.0}
CURRENT = {"A": 1.0, "mA": 1e-3}
INERTIA = {"kgm2": 1.0, "gcm2": 1e-7}

NUMBERS = (
    Column("voltage", {"V": 1.0}),
    Column("voltage_min", {"V": 1.0}),
    Column("voltage_max", {"V": 1.0}),
    Column("stall_torque", TORQUE),
    Column("no_load_speed", SPEED),
    Column("stall_current", CURRENT),
    Column("standby_current", CURRENT),
    Column("rated_torque", TORQUE),
    Column("mass", {"kg": 1.0, "g": 1e-3}),
    Column("gear_ratio", {"": 1.0}),
    Column("armature", INERTIA),
    Column("winding_resistance", {"ohm": 1.0}),
    Column("torque_constant", {"Nm_A": 1.0, "mNm_A": 1e-3}),
    Column("thermal_resistance_winding", {"K_W": 1.0}),
    Column("thermal_resistance_housing", {"K_W": 1.0}),
    Column("thermal_time_winding", {"s": 1.0}),
    Column("thermal_time_housing", {"s": 1.0}),
    Column("winding_temperature_max", {"degC": 1.0}),
    Column("price", {"": 1.0}),
)

TEXTS = (
    "model", "maker", "motor_type", "bus", "armature_source", "currency", "price_date",
    "price_source", "source", "note", "uncertain",
)  # fmt: skip

REQUIRED = ("model", "voltage", "stall_torque", "no_load_speed", "mass")
"""Fields whose columns must be there; cells of speed and mass may be empty."""

COMPUTED = frozenset(
    (
        "derated_torque_Nm_stall_over_5", "kt_output_Nm_per_A_est", "resistance_ohm_est",
        "implied_drivetrain_efficiency_est", "stall_torque_per_mass_Nm_kg",
    )
)  # fmt: skip
"""Columns that follow from others: read over, for nothing is built from them."""

ORDER = (
    "model", "maker", "motor_type", "bus", "voltage", "voltage_min", "voltage_max", "stall_torque",
    "no_load_speed", "stall_current", "standby_current", "rated_torque", "mass", "gear_ratio",
    "armature", "armature_source", "winding_resistance", "torque_constant",
    "thermal_resistance_winding", "thermal_resistance_housing", "thermal_time_winding",
    "thermal_time_housing", "winding_temperature_max", "price", "currency", "price_date",
    "price_source", "source", "note", "uncertain",
)  # fmt: skip
"""Fields in the order in which files are written."""


class NumberCell(NamedTuple):
    """What a header of numbers stands for: a field and the factor to its unit."""

    field: str
    factor: float


def _header(field: str, unit: str) -> str:
    return f"{field}_{unit}" if unit else field


BY_HEADER = {
    _header(column.field, unit): NumberCell(column.field, factor)
    for column in NUMBERS
    for unit, factor in column.units.items()
}
"""Every header of numbers that is understood."""

HEADERS = {column.field: [_header(column.field, unit) for unit in column.units]
           for column in NUMBERS} | {name: [name] for name in TEXTS}  # fmt: skip
"""Headers by field; the first of each is how the package writes it."""
