"""Catalogues of motors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from hexapod_pin.drive.catalog.motor_record import MotorRecord
from hexapod_pin.errors import ParameterError, UnknownNameError

SAME_VOLTAGE = 1e-6
"""Relative difference up to which two voltages are the same [-]."""


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
        wanted = model.strip().casefold()
        found = [r for r in self.records if wanted in (r.model.casefold(), r.name.casefold())]
        if not found:
            raise UnknownNameError("motor", model, list(self.models))
        fits = [r for r in found if voltage is None or _same(r.voltage, voltage)]
        if len(fits) == 1:
            return fits[0]
        allowed = "one of " + ", ".join(f"{r.voltage:g}" for r in found) + " V"
        hint = "Between them: the nearest record's motor(voltage_ratio=...)." if voltage else ""
        raise ParameterError(f"voltage of {found[0].model}", voltage, allowed, hint)


def _same(one: float, other: float) -> bool:
    return abs(one - other) <= SAME_VOLTAGE * one
