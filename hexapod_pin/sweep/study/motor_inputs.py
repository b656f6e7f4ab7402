"""Servos with motors of a catalogue, at the voltage of a supply."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from hexapod_pin.drive.catalog import Catalog, MotorRecord, load_catalog
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError
from hexapod_pin.sweep.study.fields import suggestion
from hexapod_pin.sweep.study.study_input import StudyInput

KEYS = ("motor", "voltage", "catalog")
"""What the base may say of its motors."""


@dataclass(frozen=True, eq=False)
class StudyMotors:
    """The motors of a study.

    Attributes:
        catalog: where they are looked for.
        motor: of the base; None: none.
        voltage: of the base's supply [V]; None: that of the catalogue's record.
    """

    catalog: Catalog
    motor: str | None
    voltage: float | None

    @classmethod
    def of(cls, base: Mapping[str, Any], folder: Path) -> StudyMotors:
        """Read what the table `base` says of motors.

        Raises:
            ParameterError: no text, no voltage, or no such motor.
            CatalogError: the catalogue is not usable.
        """
        name, voltage, path = (base.get(key) for key in KEYS)
        for key, value in (("motor", name), ("catalog", path)):
            if value is not None and not (isinstance(value, str) and value):
                raise ParameterError(f"base.{key}", value, "text")
        if voltage is not None and not _is_voltage(voltage):
            raise ParameterError("base.voltage", voltage, "a number above 0 [V]")
        found = cls(_packaged() if path is None else load_catalog(folder / path), name, voltage)
        if name is not None:
            found.record(name, voltage, "base.motor")
        return found

    def record(self, name: str, voltage: float | None, where: str) -> MotorRecord:
        """Return a record by its name, or that of a model whose voltage is nearest.

        Raises:
            ParameterError: there is none, or several and no voltage to choose by.
        """
        self._require_known(name, where)
        try:
            if voltage is not None:
                return self.catalog.supplied(name, voltage)[0]
            return self.catalog.get(name)
        except ParameterError as error:
            if voltage is not None:
                raise
            allowed = f"{error.allowed} by its whole name, or beside a voltage"
            raise ParameterError(where, name, allowed, error.hint) from error

    def _require_known(self, name: str, where: str) -> None:
        known = [*self.catalog.models, *(record.name for record in self.catalog)]
        if name.strip().casefold() not in {other.casefold() for other in known}:
            raise ParameterError(where, name, f"one of {', '.join(known)}", suggestion(name, known))

    def servo_with(self, servo: Servo, values: Mapping[str, Any]) -> Servo:
        """Return servos with the motor that the values, or the base, name.

        Raises:
            ParameterError: the motor has no torque-speed line, or is not made for the voltage.
        """
        name = values.get("motor", self.motor)
        if name is None:
            return servo
        voltage = values.get("voltage", self.voltage)
        record = self.record(name, voltage, "motor")
        ratio = 1.0 if voltage is None else voltage / record.voltage
        return servo.model_copy(update={"motor": record.motor(ratio)})

    def check(self, inputs: Sequence[StudyInput]) -> None:
        """Refuse names that the catalogue does not have, and a voltage of no motor.

        Raises:
            ParameterError: naming the place in the file.
        """
        named = {item.name: item for item in inputs}
        voltage = named.get("voltage")
        if voltage is not None and "motor" not in named and self.motor is None:
            allowed = "beside an input motor, or base.motor: their catalogue has the rated voltage"
            raise ParameterError(f"{voltage.where}.input", "voltage", allowed)
        if self.voltage is not None and "motor" not in named and self.motor is None:
            allowed = "left out without base.motor or an input motor"
            raise ParameterError("base.voltage", self.voltage, allowed)
        if "motor" in named:
            item = named["motor"]
            for k, name in enumerate(item.names):
                where = f"{item.where}.values[{k}]"
                if voltage is None:
                    self.record(name, self.voltage, where)
                else:  # a voltage that a motor is not made for is refused case by case
                    self._require_known(name, where)

    def meaning(self, inputs: Sequence[StudyInput]) -> dict[str, Any] | None:
        """Return the records that cases may take, as plain data; None where no input is of them."""
        named = {item.name: item for item in inputs}
        if not named.keys() & {"motor", "voltage"}:
            return None
        names = named["motor"].names if "motor" in named else (self.motor or "",)
        models = {r.model for r in self.catalog for n in names
                  if n.strip().casefold() in (r.model.casefold(), r.name.casefold())}  # fmt: skip
        records = [r.model_dump(mode="json") for r in self.catalog if r.model in models]
        return {"motor": self.motor, "voltage": self.voltage, "records": records}


@lru_cache(maxsize=1)
def _packaged() -> Catalog:
    return load_catalog()


def _is_voltage(value: object) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and 0.0 < value < float("inf")  # type: ignore[operator]
