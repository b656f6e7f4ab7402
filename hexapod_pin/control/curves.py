"""Curves as data: a sine, a smooth curve through points, and one through points and rates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from hexapod_pin.arrays import Array
from hexapod_pin.control.motion_function import MotionFunction
from hexapod_pin.control.step_functions import PIECES_PER_PERIOD
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


class Sine(MotionFunction):
    """mean + amplitude sin(2 pi t / period + phase).

    Attributes:
        amplitude: unit of what it describes.
        period: [s].
        phase: [rad].
        mean: unit of what it describes.
    """

    kind: Literal["sine"] = "sine"
    amplitude: float
    period: float = Field(gt=0.0)
    phase: float = 0.0
    mean: float = 0.0

    def value_and_rate(self, time: Array) -> tuple[Array, Array]:
        """Return the value and its derivative at times [s], of their shape."""
        rate = 2.0 * np.pi / self.period
        angle = rate * time + self.phase
        return self.mean + self.amplitude * np.sin(angle), rate * self.amplitude * np.cos(angle)

    def acceleration(self, time: Array, inside: Array | None = None) -> Array:
        """Return the second derivative at times [s]; it has no kinks."""
        rate = 2.0 * np.pi / self.period
        bend: Array = -(rate**2) * self.amplitude * np.sin(rate * time + self.phase)
        return bend

    def kinks_until(self, end: float) -> tuple[float, ...]:
        """Return the times at which a derivative jumps [s]: none."""
        return ()

    @property
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial [s]."""
        return self.period / PIECES_PER_PERIOD


class Waypoints(MotionFunction):
    """A smooth curve through points; at rest before the first and after the last.

    The quintic spline with zero first and second derivative at both ends: four times continuously
    differentiable between them and twice at them. Between two points alone it is the curve of
    least jerk. As every spline it may swing beyond its points.

    Attributes:
        time: strictly increasing [s]. Two or more.
        value: at these times; unit of what it describes.

    Raises:
        ParameterError: fewer than two points, unequal numbers, or times not increasing.
    """

    kind: Literal["waypoints"] = "waypoints"
    time: tuple[FiniteFloat, ...]
    value: tuple[FiniteFloat, ...]

    def __init__(self, /, **fields: Any) -> None:
        """Check the points."""
        super().__init__(**fields)
        if len(self.time) != len(self.value) or len(self.time) < 2:
            counts = (len(self.time), len(self.value))
            raise ParameterError("Waypoints lengths of time and value", counts, "equal, 2 or more")
        if not (np.diff(self.time) > 0.0).all():
            raise ParameterError("Waypoints.time", self.time, "strictly increasing [s]")

    def value_and_rate(self, time: Array) -> tuple[Array, Array]:
        """Return the value and its derivative at times [s], of their shape."""
        spline, inside = self._spline(), np.clip(time, self.time[0], self.time[-1])
        moving = (time >= self.time[0]) & (time <= self.time[-1])
        return spline(inside), np.where(moving, spline.derivative()(inside), 0.0)

    def acceleration(self, time: Array, inside: Array | None = None) -> Array:
        """Return the second derivative at times [s]: continuous, 0 at the ends and outside."""
        bend = self._spline().derivative(2)(np.clip(time, self.time[0], self.time[-1]))
        moving = (time > self.time[0]) & (time < self.time[-1])
        return np.where(moving, bend, 0.0)

    def _spline(self) -> BSpline:
        from scipy.interpolate import make_interp_spline

        rest = [(1, 0.0), (2, 0.0)]
        return make_interp_spline(self.time, self.value, k=5, bc_type=(rest, rest))

    def kinks_until(self, end: float) -> tuple[float, ...]:
        """Return the times at which a derivative jumps [s]: the fifth, or at the ends the third."""
        return self.time

    @property
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial, from one point to the next [s]."""
        return float("inf")


class Hermite(MotionFunction):
    """The cubic curve through points with given rates, once continuously differentiable.

    Before the first and after the last point it goes straight on at the rate that it has there.

    Attributes:
        time: strictly increasing [s]. Two or more.
        value: at these times; unit of what it describes.
        rate: its derivative at these times [1/s of that].

    Raises:
        ParameterError: fewer than two points, unequal numbers, or times not increasing.
    """

    kind: Literal["hermite"] = "hermite"
    time: tuple[FiniteFloat, ...]
    value: tuple[FiniteFloat, ...]
    rate: tuple[FiniteFloat, ...]

    def __init__(self, /, **fields: Any) -> None:
        """Check the points."""
        super().__init__(**fields)
        counts = (len(self.time), len(self.value), len(self.rate))
        if len(set(counts)) > 1 or counts[0] < 2:
            raise ParameterError(
                "Hermite lengths of time, value and rate", counts, "equal, 2 or more"
            )
        if not (np.diff(self.time) > 0.0).all():
            raise ParameterError("Hermite.time", self.time, "strictly increasing [s]")

    def value_and_rate(self, time: Array) -> tuple[Array, Array]:
        """Return the value and its derivative at times [s], of their shape."""
        value, rate, bend, jerk, since = self._pieces(time, time)
        position = value + since * (rate + since * (bend / 2.0 + since * jerk / 6.0))
        return position, rate + since * (bend + since * jerk / 2.0)

    def acceleration(self, time: Array, inside: Array | None = None) -> Array:
        """Return the second derivative; `inside` picks the piece where it jumps."""
        *_, bend, jerk, since = self._pieces(time, time if inside is None else inside)
        acceleration: Array = bend + since * jerk
        return acceleration

    def kinks_until(self, end: float) -> tuple[float, ...]:
        """Return the times at which a derivative jumps [s]: those of the points."""
        return self.time

    @property
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial between kinks [s]: it is one."""
        return float("inf")

    def _pieces(self, time: Array, inside: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Return the derivatives 0..3 at the begin of the pieces, and the time since then [s]."""
        t, x, v = (np.array(one) for one in (self.time, self.value, self.rate))
        h, mean = np.diff(t), np.diff(x) / np.diff(t)
        bend = (6.0 * mean - 4.0 * v[:-1] - 2.0 * v[1:]) / h
        jerk = (6.0 * (v[:-1] + v[1:]) - 12.0 * mean) / h**2
        outside = np.zeros(1)
        piece = np.searchsorted(t, inside, side="right")  # 0: before the first point
        return (
            np.append(x[:1], x)[piece],
            np.append(v[:1], v)[piece],
            np.concatenate([outside, bend, outside])[piece],
            np.concatenate([outside, jerk, outside])[piece],
            np.asarray(time - np.append(t[:1], t)[piece]),
        )
