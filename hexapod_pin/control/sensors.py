"""Sensors add noise, offset, rounding and delay to the true state.

Readings of several runs are made in lock-step.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, field_validator
from pydantic_core.core_schema import ValidationInfo

from hexapod_pin.arguments import checked, every_step
from hexapod_pin.arrays import Array
from hexapod_pin.control.feedback import Measurement
from hexapod_pin.errors import ParameterError, StateError
from hexapod_pin.robot import rotations
from hexapod_pin.spec import Spec

QUANTITIES = ("q", "v", "torque", "rotation", "angular_velocity", "acceleration", "foot_force")
"""Fields of `Measurement` that a sensor reads. Their order numbers their random streams."""

LARGEST_SEED = 2**63 - 1
"""Largest integer that TOML keeps."""


class Sensor(Spec):
    """Errors of one quantity: reading = multiple of the step nearest to (value + offset + noise).

    All three numbers are in the unit of the quantity and apply to each of its components.

    Attributes:
        noise: standard deviation of the error that is drawn again for every reading.
        bias: standard deviation of the offset, drawn once per run and component.
        quantisation: step of rounding; 0: none. A half step goes to the even multiple.
    """

    noise: NonNegativeFloat = 0.0
    bias: NonNegativeFloat = 0.0
    quantisation: NonNegativeFloat = 0.0

    @property
    def is_ideal(self) -> bool:
        """Whether readings are the true values."""
        return self.noise == self.bias == self.quantisation == 0.0


class Sensors(Spec):
    """How `Measurement`s are read; ideal by default.

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
            above this [N]; 0: the true value.
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
        """Whether readings are the true values, even if late."""
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
        return SensorReader(self, case_numbers)


# Readings of the sensors of runs in lock-step.


@checked
class SensorReader:
    """Turns the true values at a tick into the readings of a controller.

    A reading is a function of the case, the tick and the true values: a checkpoint need not hold a
    reader, and a new one continues where another stopped. Its state is only a cache.

    Attributes:
        sensors: the settings.
        case_numbers: of the runs, in the order of the batch axis.
    """

    def __init__(self, sensors: Sensors, case_numbers: Sequence[int]) -> None:
        """Prepare the streams of errors.

        Raises:
            ParameterError: no case, or a number below 0 or from 2^64 up.
        """
        self.sensors, self.case_numbers = sensors, tuple(map(operator.index, case_numbers))
        if not self.case_numbers or not all(0 <= case < 2**64 for case in self.case_numbers):
            allowed = "at least one number, each from 0 to 2^64 - 1"
            raise ParameterError("case_numbers", self.case_numbers, allowed)
        self._is_ideal = sensors.is_ideal
        self._readings = {
            name: (_RotationReadings if name == "rotation" else _Readings)(
                SensorErrors(getattr(sensors, name), sensors.seed, self.case_numbers, number)
            )
            for number, name in enumerate(QUANTITIES)
            if not getattr(sensors, name).is_ideal
        }

    @every_step
    def read(self, tick: int, measurement: Measurement) -> Measurement:
        """Return the readings of a tick; `measurement` itself where the sensors are ideal.

        Args:
            tick: number of the control tick, from 0.
            measurement: the true values; arrays with a leading axis of one row per case.

        Raises:
            ParameterError: a tick below 0.
            StateError: another number of rows than of cases.
        """
        if self._is_ideal:
            return measurement
        self._check(tick, measurement)
        found: dict[str, Any] = {
            name: readings.read(tick, getattr(measurement, name))
            for name, readings in self._readings.items()
        }
        if self.sensors.loaded_threshold > 0.0:
            x, y, z = np.moveaxis(found.get("foot_force", measurement.foot_force), -1, 0)
            found["loaded"] = np.sqrt(x * x + y * y + z * z) > self.sensors.loaded_threshold
        return replace(measurement, **found)

    def _check(self, tick: int, measurement: Measurement) -> None:
        if tick < 0:
            raise ParameterError("tick", tick, "0 or above")
        rows = measurement.q.shape[:-1]
        if rows != (len(self.case_numbers),):
            raise StateError(
                f"measurement.q has leading axes {rows}; the sensors were started for "
                f"{len(self.case_numbers)} cases, one row each."
            )


class _Readings:
    """Readings of a quantity whose components have independent errors; caches a block of them."""

    def __init__(self, errors: SensorErrors) -> None:
        self._source, self._step = errors, errors.sensor.quantisation
        self._is_exact = errors.sensor.noise == errors.sensor.bias == 0.0
        self._block: tuple[int, int] | None = None
        self._errors: Array = np.empty(0)

    def read(self, tick: int, truth: Array) -> Array:
        """Return truth (B, ...) plus errors, rounded."""
        if not self._is_exact:
            rows = truth.reshape(len(truth), -1)
            block = (self._source.block(tick), rows.shape[1])
            if block != self._block:
                self._errors, self._block = self._source.draw(*block), block
            truth = (rows + self._errors[tick % len(self._errors)]).reshape(truth.shape)
        return _rounded(truth, self._step)


class _RotationReadings:
    """Readings of the trunk's orientation; caches a block of small rotations."""

    def __init__(self, errors: SensorErrors) -> None:
        self._source, self._step = errors, errors.sensor.quantisation
        self._is_exact = errors.sensor.noise == errors.sensor.bias == 0.0
        self._block: int | None = None
        self._turns: Array = np.empty(0)

    def read(self, tick: int, truth: Array) -> Array:
        """Return truth (B, 3, 3) times exp(error), its roll, pitch and yaw rounded."""
        rotation = np.ascontiguousarray(truth.transpose(1, 2, 0))
        if not self._is_exact:
            block = self._source.block(tick)
            if block != self._block:
                vectors = np.ascontiguousarray(np.moveaxis(self._source.draw(block, 3), -1, 0))
                self._turns, self._block = rotations.rotation_from_vector(vectors), block
            turn = self._turns[:, :, tick % self._turns.shape[2]]
            rotation = rotations.orthonormalised(rotations.product(rotation, turn))
        if self._step > 0.0:
            angles = _rounded(rotations.roll_pitch_yaw(rotation), self._step)
            rotation = rotations.rotation_from_angles(angles)
        return np.ascontiguousarray(rotation.transpose(2, 0, 1))


def _rounded(values: Array, step: float) -> Array:
    """Return the nearest multiples of a step; the values themselves for step 0."""
    return np.asarray(np.rint(values / step) * step) if step > 0.0 else values


# Random errors that depend on their place alone, so that no run has to remember them.
#
# Philox4x64-10 [Salmon2011] is a counter-based generator: key (seed, case), counter (position,
# quantity, purpose, 0). A component of a tick has its fixed position, so that any part can be
# drawn.

BLOCK_TICKS = 128
"""Ticks drawn at once, a multiple of 4: a Philox counter yields 4 words."""

GROUP_ROWS = 16
"""Rows drawn at once: their intermediate results fit a core's cache."""

NOISE, OFFSET = 0, 1
"""Purposes of a stream."""


class SensorErrors:
    """Noise plus offset of one quantity in B runs, drawn block by block.

    Attributes:
        sensor: standard deviations, in the unit of the quantity.
        seed: of all errors.
        case_numbers: (B,).
        quantity: number of the quantity, which has its own streams.
    """

    def __init__(
        self, sensor: Sensor, seed: int, case_numbers: tuple[int, ...], quantity: int
    ) -> None:
        """Draw nothing yet."""
        self.sensor, self.seed = sensor, seed
        self.case_numbers, self.quantity = case_numbers, quantity

    def block(self, tick: int) -> int:
        """Return the number of the block that holds a tick; all ticks are in one without noise."""
        return tick // BLOCK_TICKS if self.sensor.noise > 0.0 else 0

    def draw(self, block: int, components: int) -> Array:
        """Return the errors of a block, (ticks, B, components); of one tick if all are equal."""
        offset = np.zeros((1, len(self.case_numbers), components))
        if self.sensor.bias > 0.0:
            self._add_normals(offset, self.sensor.bias, OFFSET, 0)
        if self.sensor.noise == 0.0:
            return offset
        errors = np.repeat(offset, BLOCK_TICKS, axis=0)
        self._add_normals(errors, self.sensor.noise, NOISE, block * BLOCK_TICKS)
        return errors

    def _add_normals(self, errors: Array, deviation: float, purpose: int, start: int) -> None:
        """Add normal numbers to errors (ticks, B, components) that begin at tick `start`."""
        ticks, batch, components = errors.shape
        words = (components + 1) // 2  # per tick
        stream = np.random.Philox(key=0)
        state = stream.state
        for first in range(0, batch, GROUP_ROWS):
            group = slice(first, first + GROUP_ROWS)
            cases = self.case_numbers[group]
            raw = np.empty((ticks, len(cases), words), np.uint64)
            for row, case in enumerate(cases):
                state["state"]["key"][:] = self.seed, case
                state["state"]["counter"][:] = start * words // 4, self.quantity, purpose, 0
                stream.state = state
                raw[:, row] = stream.random_raw(ticks * words).reshape(ticks, words)
            errors[:, group] += deviation * box_muller(raw)[..., :components]


def box_muller(words: NDArray[np.uint64]) -> Array:
    """Return standard normal numbers (..., 2 n) from random 64-bit words (..., n).

    sqrt(-2 log u1) (cos, sin)(2 pi u2) [BoxMuller1958], u1 from the upper half of a word and u2
    from the lower. In single precision (24 bits, at most 6.8), which costs a third of NumPy's
    normal numbers.
    """
    unit = np.float32(2.0**-32)
    high, low = ((words >> np.uint64(shift)).astype(np.uint32) for shift in (32, 0))
    radius = high.astype(np.float32) * unit
    radius += np.float32(0.5) * unit  # u1, in (0, 1]
    np.log(radius, out=radius)
    radius *= np.float32(-2.0)
    np.sqrt(radius, out=radius)
    angle = low.astype(np.float32) * (np.float32(2.0 * np.pi) * unit)
    n = words.shape[-1]
    normals = np.empty((*words.shape[:-1], 2 * n))
    np.multiply(radius, np.cos(angle), out=normals[..., :n])
    np.multiply(radius, np.sin(angle), out=normals[..., n:])
    return normals
