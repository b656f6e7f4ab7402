"""What the sensors of a robot make of the truth: noise, offset, rounding and delay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, NonNegativeFloat, field_validator
from pydantic_core.core_schema import ValidationInfo

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from hexapod_pin.control.sensor_reader import SensorReader

QUANTITIES = ("q", "v", "torque", "rotation", "angular_velocity", "acceleration", "foot_force")
"""Fields of `Measurement` that a sensor reads. Their order numbers their random streams."""

LARGEST_SEED = 2**63 - 1
"""Largest integer that TOML keeps."""


class Sensor(Spec):
    """Errors of one quantity: reading = nearest multiple of the step to (truth + offset + noise).

    All three numbers are in the unit of the quantity and apply to each of its components.

    Attributes:
        noise: standard deviation of the error that is drawn anew for every reading.
        bias: standard deviation of the offset, drawn once per run and component.
        quantisation: step of rounding; 0: none. A half step goes to the even multiple.
    """

    noise: NonNegativeFloat = 0.0
    bias: NonNegativeFloat = 0.0
    quantisation: NonNegativeFloat = 0.0

    @property
    def is_ideal(self) -> bool:
        """Whether readings are the truth."""
        return self.noise == self.bias == self.quantisation == 0.0


class Sensors(Spec):
    """How `Measurement`s are read; ideal unless told otherwise.

    Errors are normally distributed, and depend on the seed, the number of the case, the tick,
    the quantity and its component alone: not on which runs go in lock-step, nor on whether a run
    was cut and continued, nor on the other sensors.

    Attributes:
        q: joint angles [rad].
        v: joint rates [rad/s].
        torque: of the joint drives [N m].
        rotation: trunk orientation [rad]. Noise and offset are a rotation vector in trunk axes;
            rounded are roll, pitch and yaw, where rotation = Rz(yaw) Ry(pitch) Rx(roll).
        angular_velocity: of the trunk, trunk axes [rad/s].
        acceleration: of the trunk, trunk axes [m/s^2].
        foot_force: of the ground on the feet, components in world axes [N].
        loaded_threshold: a foot counts as loaded where the magnitude of its force, as read, is
            above this [N]; 0: as the simulator has it.
        delay: how long before its tick a measurement was taken [s].
        seed: of all errors; 0 <= seed < 2^63.
    """

    kind: Literal["sensors"] = "sensors"
    q: Sensor = Sensor()
    v: Sensor = Sensor()
    torque: Sensor = Sensor()
    rotation: Sensor = Sensor()
    angular_velocity: Sensor = Sensor()
    acceleration: Sensor = Sensor()
    foot_force: Sensor = Sensor()
    loaded_threshold: NonNegativeFloat = 0.0
    delay: NonNegativeFloat = 0.0
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = 0

    @field_validator(*QUANTITIES, mode="before")
    @classmethod
    def _from_table(cls, value: Any, info: ValidationInfo) -> Any:
        """Build a sensor from its TOML table, so that an error names the quantity too."""
        if not isinstance(value, Mapping):
            return value
        try:
            return Sensor(**value)
        except ParameterError as error:
            name = f"{cls.__name__}.{info.field_name}.{error.name.partition('.')[2]}"
            raise ParameterError(name, error.value, error.allowed) from error

    @property
    def is_ideal(self) -> bool:
        """Whether readings are the truth, even if late."""
        return self.loaded_threshold == 0.0 and all(
            getattr(self, quantity).is_ideal for quantity in QUANTITIES
        )

    def start(self, case_numbers: Sequence[int]) -> SensorReader:
        """Return what reads the measurements of these runs.

        Args:
            case_numbers: one for each run in lock-step, in the order of the batch axis (B,).

        Raises:
            ParameterError: no case, or a number below 0 or from 2^64 up.
        """
        from hexapod_pin.control.sensor_reader import SensorReader

        return SensorReader(self, case_numbers)
