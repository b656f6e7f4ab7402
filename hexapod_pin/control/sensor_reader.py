"""Readings of the sensors of runs in lock-step."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control import attitude
from hexapod_pin.control.feedback import Measurement
from hexapod_pin.control.sensor_noise import SensorErrors
from hexapod_pin.control.sensors import QUANTITIES, Sensors
from hexapod_pin.errors import ParameterError, StateError


class SensorReader:
    """Turns the truth at a tick into what a controller is told.

    A reading is a function of the case, the tick and the truth: a checkpoint need not hold a
    reader, and a new one continues where another stopped. What is kept is a cache.

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

    def read(self, tick: int, measurement: Measurement) -> Measurement:
        """Return the readings of a tick; `measurement` itself where the sensors are ideal.

        Args:
            tick: number of the control tick, from 0.
            measurement: the truth; arrays with a leading axis of one row per case.

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
    """Readings of a quantity whose components have independent errors; keeps a block of them."""

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
    """Readings of the trunk's orientation; keeps a block of small rotations."""

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
                self._turns, self._block = attitude.rotation_from_vector(vectors), block
            turn = self._turns[:, :, tick % self._turns.shape[2]]
            rotation = attitude.orthonormalised(attitude.product(rotation, turn))
        if self._step > 0.0:
            angles = _rounded(attitude.roll_pitch_yaw(rotation), self._step)
            rotation = attitude.rotation_from_angles(angles)
        return np.ascontiguousarray(rotation.transpose(2, 0, 1))


def _rounded(values: Array, step: float) -> Array:
    """Return the nearest multiples of a step; the values themselves for step 0."""
    return np.asarray(np.rint(values / step) * step) if step > 0.0 else values
