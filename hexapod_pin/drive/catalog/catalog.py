"""Catalogues of motors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.drive.catalog.motor_record import MotorRecord
from hexapod_pin.drive.catalog.table import catalog_table
from hexapod_pin.drive.catalog.write import catalog_text
from hexapod_pin.errors import (
    CatalogError,
    CatalogFault,
    ParameterError,
    TraceFileError,
    UnknownNameError,
)
from hexapod_pin.user_file import user_path

SAME_VOLTAGE = 1e-6
"""Relative difference up to which two voltages are the same [-]."""


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
            f"voltage of {found[0].model}", voltage, f"one of {_voltages(found)} V",
            f"Write {found[0].name!r}, or the like, for one of them.",
        )  # fmt: skip

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

    def supplied(self, model: str, supply: float) -> tuple[MotorRecord, float]:
        """Return the record nearest to a supply voltage, and the supply over its voltage [-].

        Args:
            model: as of `get`.
            supply: [V].

        Raises:
            UnknownNameError: there is no such model.
            ParameterError: the motor is not made for this supply.
        """
        found = self._of(model)
        nearest = min(found, key=lambda r: abs(r.voltage - supply))
        low = min(r.voltage_min or r.voltage for r in found)
        high = max(r.voltage_max or r.voltage for r in found)
        if not low <= supply <= high:
            allowed = f"from {low:g} to {high:g} V (data at {_voltages(found)} V)"
            raise ParameterError(f"voltage of {nearest.model}", supply, allowed)
        return nearest, supply / nearest.voltage

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
