"""Transitions between two values as in ADAMS: STEP, STEP5 and HAVSIN.

With s from 0 at the begin to 1 at the end, the value is initial + (final - initial) h(s); it stays
before and after.

| function | h(s) | continuous | largest rate | largest acceleration |
|---|---|---|---|---|
| STEP | s^2 (3 - 2 s) | C1 | 1.5 | 6, at the ends |
| STEP5 | s^3 (10 - 15 s + 6 s^2) | C2 | 1.875 | 10 / sqrt(3) |
| HAVSIN | 1/2 + sin(pi s - pi/2) / 2 | C1 | pi/2 | pi^2 / 2, at the ends |

Rates are times (final - initial) / (end - begin), accelerations over its square.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Literal

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.motion_function import MotionFunction
from hexapod_pin.errors import ParameterError

PIECES_PER_PERIOD = 4
"""Pieces in which a polynomial of degree 10 follows a sine to 1e-11 of its amplitude."""


def adams_step(s: Array) -> tuple[Array, Array, Array]:
    """Return ADAMS' STEP from 0 to 1, its derivative, and its second one from inside at the ends.

    Args:
        s: below 0 and above 1 the ends are returned. Any shape.
    """
    x = np.clip(s, 0.0, 1.0)
    return x**2 * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x), 6.0 - 12.0 * x


def adams_step5(s: Array) -> tuple[Array, Array, Array]:
    """Return ADAMS' STEP5 from 0 to 1 with both derivatives; `s` as of `adams_step`."""
    x = np.clip(s, 0.0, 1.0)
    left = 1.0 - x
    return (
        x**3 * (10.0 - 15.0 * x + 6.0 * x**2),
        30.0 * (x * left) ** 2,
        60.0 * x * left * (left - x),
    )


def adams_havsin(s: Array) -> tuple[Array, Array, Array]:
    """Return ADAMS' HAVSIN from 0 to 1 with both derivatives; `s` as of `adams_step`."""
    angle = np.pi * np.clip(s, 0.0, 1.0)
    half = 0.5 * np.pi
    return 0.5 - 0.5 * np.cos(angle), half * np.sin(angle), half * np.pi * np.cos(angle)


class _Transition(MotionFunction):
    """From one value to another between two times; the shape is that of the final classes.

    Raises:
        ParameterError: `end` is not after `begin`.
    """

    begin: float
    end: float
    initial: float
    final: float

    def __init__(self, /, **fields: Any) -> None:
        """Check the times."""
        super().__init__(**fields)
        if not self.end > self.begin:
            name = type(self).__name__
            raise ParameterError(f"{name}.end", self.end, f"after {name}.begin = {self.begin:g} s")

    @staticmethod
    @abstractmethod
    def _shape(s: Array) -> tuple[Array, Array, Array]:
        """Return h, h' and h'' of this module's table."""

    def value_and_rate(self, time: Array) -> tuple[Array, Array]:
        """Return the value and its derivative at times [s], of their shape."""
        length, change = self.end - self.begin, self.final - self.initial
        h, dh, _ = self._shape((time - self.begin) / length)
        return self.initial + change * h, change / length * dh

    def acceleration(self, time: Array, inside: Array | None = None) -> Array:
        """Return the second derivative; 0 before the begin and from the end on, unless `inside`."""
        at = np.asarray(time if inside is None else inside)
        length = self.end - self.begin
        bend = self._shape((time - self.begin) / length)[2]
        moving = (at >= self.begin) & (at < self.end)
        return np.where(moving, (self.final - self.initial) / length**2 * bend, 0.0)

    def kinks_until(self, end: float) -> tuple[float, ...]:
        """Return begin and end: there a derivative jumps [s]."""
        return self.begin, self.end

    @property
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial between kinks [s]: it is one."""
        return float("inf")


class Step(_Transition):
    """ADAMS' STEP(time, begin, initial, end, final): cubic, the acceleration jumps at both ends.

    Attributes:
        begin: [s].
        end: after `begin` [s].
        initial: value until `begin`; unit of what it describes.
        final: value from `end` on.

    Raises:
        ParameterError: `end` is not after `begin`.
    """

    kind: Literal["step"] = "step"

    @staticmethod
    def _shape(s: Array) -> tuple[Array, Array, Array]:
        return adams_step(s)


class Step5(_Transition):
    """ADAMS' STEP5(time, begin, initial, end, final): quintic, twice continuously differentiable.

    Attributes:
        begin: [s].
        end: after `begin` [s].
        initial: value until `begin`; unit of what it describes.
        final: value from `end` on.

    Raises:
        ParameterError: `end` is not after `begin`.
    """

    kind: Literal["step5"] = "step5"

    @staticmethod
    def _shape(s: Array) -> tuple[Array, Array, Array]:
        return adams_step5(s)


class Havsin(_Transition):
    """ADAMS' HAVSIN(time, begin, initial, end, final): half a sine, the acceleration jumps.

    Attributes:
        begin: [s].
        end: after `begin` [s].
        initial: value until `begin`; unit of what it describes.
        final: value from `end` on.

    Raises:
        ParameterError: `end` is not after `begin`.
    """

    kind: Literal["havsin"] = "havsin"

    @staticmethod
    def _shape(s: Array) -> tuple[Array, Array, Array]:
        return adams_havsin(s)

    @property
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial: a quarter of its sine's period [s]."""
        return 2.0 * (self.end - self.begin) / PIECES_PER_PERIOD
