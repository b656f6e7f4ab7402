"""Functions of time are data: ADAMS steps, sines, and smooth curves through points."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


# What every function of time answers: value, rate, acceleration, and where a derivative jumps.


class MotionFunction(Spec):
    """A continuously differentiable function of time, with its exact derivatives.

    Values have the unit of what the function describes. Where the acceleration jumps it has two
    values: `inside`, a time between this kink and the next or the last, selects one.
    """

    @abstractmethod
    def value_and_rate(self, time: Array) -> tuple[Array, Array]:
        """Return the value and its derivative at times [s], of their shape."""

    @abstractmethod
    def acceleration(self, time: Array, inside: Array | None = None) -> Array:
        """Return the second derivative.

        Args:
            time: [s]. Any shape.
            inside: times [s] of the same shape, each within the piece between two kinks whose
                value is wanted where `time` is a kink; None: of the piece that begins there.

        Returns:
            Shape of `time`.
        """

    @abstractmethod
    def kinks_until(self, end: float) -> tuple[float, ...]:
        """Return the times not after `end` at which a derivative jumps, or more of them [s]."""

    @property
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial between kinks; infinite where it is one [s]."""
        return math.inf

    def derivatives(self, time: Array, inside: Array | None = None) -> tuple[Array, Array, Array]:
        """Return value, rate and acceleration; arguments as of `acceleration`."""
        return (*self.value_and_rate(time), self.acceleration(time, inside))


# Curves as data: a sine, a smooth curve through points, and one through points and rates.


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
            raise ParameterError("Waypoints.time, value", counts, "of equal lengths, 2 or more")
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
            raise ParameterError("Hermite.time, value, rate", counts, "of equal lengths, 2 or more")
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


# Transitions between two values as in ADAMS: STEP, STEP5 and HAVSIN, and a rate that follows STEPs.
#
# With s from 0 at the begin to 1 at the end, the value is initial + (final - initial) h(s); it
# stays before and after.
#
# | function | h(s) | continuous | largest rate | largest acceleration |
# |---|---|---|---|---|
# | STEP | s^2 (3 - 2 s) | C1 | 1.5 | 6, at the ends |
# | STEP5 | s^3 (10 - 15 s + 6 s^2) | C2 | 1.875 | 10 / sqrt(3) |
# | HAVSIN | 1/2 + sin(pi s - pi/2) / 2 | C1 | pi/2 | pi^2 / 2, at the ends |
# | rate by STEPs, ramps of share r | h' = (STEP up - STEP down) / (1 - r) | C2 | 1 / (1 - r) |
#   1.5 / (r (1 - r)), in the middle of the ramps |
#
# Rates are times (final - initial) / (end - begin), accelerations over its square.

PIECES_PER_PERIOD = 4
"""Pieces in which a polynomial of degree 10 follows a sine to 1e-11 of its amplitude."""


def adams_step(s: Array) -> tuple[Array, Array, Array]:
    """Return ADAMS' STEP from 0 to 1, its derivative, and its second one from inside at the ends.

    Args:
        s: below 0 and above 1 the ends are returned. Any shape.
    """
    x = np.clip(s, 0.0, 1.0)
    return x**2 * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x), 6.0 - 12.0 * x


RAMP_SHARE = 0.1
"""Share of a move in which its rate rises to the plateau, and again in which it falls [-],
*assumed*: the break points of [S2]'s figure 3 cannot be read."""


def velocity_step(s: Array, ramp_share: float) -> tuple[Array, Array, Array]:
    """Return a move from 0 to 1 whose rate follows ADAMS' STEPs, and its two derivatives.

    The rate rises from 0 by a STEP, stays at 1 / (1 - ramp_share), and falls to 0 by a STEP.

    Args:
        s: below 0 and above 1 the ends are returned. Any shape.
        ramp_share: of each ramp, above 0 and up to 0.5 [-].
    """
    x = np.clip(s, 0.0, 1.0)
    rising = np.clip(x / ramp_share, 0.0, 1.0)
    falling = np.clip((x - 1.0 + ramp_share) / ramp_share, 0.0, 1.0)
    (up, up_rate, _), (down, down_rate, _) = adams_step(rising), adams_step(falling)
    level = 1.0 / (1.0 - ramp_share)
    # the integral of STEP over its ramp is u^3 - u^4 / 2, and grows by 1 per unit of time after it
    gained = rising**3 * (1.0 - 0.5 * rising) - falling**3 * (1.0 - 0.5 * falling)
    travelled = ramp_share * gained + np.maximum(x - ramp_share, 0.0)
    return level * travelled, level * (up - down), level / ramp_share * (up_rate - down_rate)


class _Transition(MotionFunction):
    """From one value to another between two times; the shape is that of the final classes.

    Attributes:
        start: [s].
        end: after `start` [s].
        initial: value until `start`; unit of what it describes.
        final: value from `end` on.

    Raises:
        ParameterError: `end` is not after `start`.
    """

    start: float
    end: float
    initial: float
    final: float

    def __init__(self, /, **fields: Any) -> None:
        """Check the times."""
        super().__init__(**fields)
        if not self.end > self.start:
            name = type(self).__name__
            raise ParameterError(f"{name}.end", self.end, f"after {name}.start = {self.start:g} s")

    @abstractmethod
    def _shape(self, s: Array) -> tuple[Array, Array, Array]:
        """Return h, h' and h'' of this module's table."""

    def value_and_rate(self, time: Array) -> tuple[Array, Array]:
        """Return the value and its derivative at times [s], of their shape."""
        length, change = self.end - self.start, self.final - self.initial
        h, dh, _ = self._shape((time - self.start) / length)
        return self.initial + change * h, change / length * dh

    def acceleration(self, time: Array, inside: Array | None = None) -> Array:
        """Return the second derivative; 0 before the begin and from the end on, unless `inside`."""
        at = np.asarray(time if inside is None else inside)
        length = self.end - self.start
        bend = self._shape((time - self.start) / length)[2]
        moving = (at >= self.start) & (at < self.end)
        return np.where(moving, (self.final - self.initial) / length**2 * bend, 0.0)

    def kinks_until(self, end: float) -> tuple[float, ...]:
        """Return begin and end: there a derivative jumps [s]."""
        return self.start, self.end


class Step(_Transition):
    """ADAMS' STEP(time, begin, initial, end, final): cubic, the acceleration jumps at both ends.

    Attributes:
        start: [s].
        end: after `start` [s].
        initial: value until `start`; unit of what it describes.
        final: value from `end` on.

    Raises:
        ParameterError: `end` is not after `start`.
    """

    kind: Literal["step"] = "step"

    def _shape(self, s: Array) -> tuple[Array, Array, Array]:
        return adams_step(s)


class Step5(_Transition):
    """ADAMS' STEP5(time, begin, initial, end, final): quintic, twice continuously differentiable.

    Attributes and errors are those of `Step`.
    """

    kind: Literal["step5"] = "step5"

    def _shape(self, s: Array) -> tuple[Array, Array, Array]:
        x = np.clip(s, 0.0, 1.0)
        left = 1.0 - x
        rate = 30.0 * (x * left) ** 2
        return x**3 * (10.0 - 15.0 * x + 6.0 * x**2), rate, 60.0 * x * left * (left - x)


class Havsin(_Transition):
    """ADAMS' HAVSIN(time, begin, initial, end, final): half a sine, the acceleration jumps.

    Attributes and errors are those of `Step`.
    """

    kind: Literal["havsin"] = "havsin"

    def _shape(self, s: Array) -> tuple[Array, Array, Array]:
        angle, half = np.pi * np.clip(s, 0.0, 1.0), 0.5 * np.pi
        return 0.5 - 0.5 * np.cos(angle), half * np.sin(angle), half * np.pi * np.cos(angle)

    @property
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial: a quarter of its sine's period [s]."""
        return 2.0 * (self.end - self.start) / PIECES_PER_PERIOD


class VelocityStep(_Transition):
    """A move whose velocity follows ADAMS' STEPs, as [S2]'s figure 3 shows joint velocities.

    The rate rises from 0 to a plateau by STEP(time, start, 0, start + r, level) and falls back to
    0 by another one that ends at `end`, with r = ramp_share (end - start) and level =
    (final - initial) / ((1 - ramp_share) (end - start)). It is twice continuously differentiable.

    Attributes:
        ramp_share: share of the time in each ramp, above 0 and up to 0.5 [-]; the default is
            *assumed*.

    The other attributes and the errors are those of `Step`.
    """

    kind: Literal["velocity-step"] = "velocity-step"
    ramp_share: float = Field(default=RAMP_SHARE, gt=0.0, le=0.5)

    def _shape(self, s: Array) -> tuple[Array, Array, Array]:
        return velocity_step(s, self.ramp_share)

    def kinks_until(self, end: float) -> tuple[float, ...]:
        """Return the ends of both ramps: there the third derivative jumps [s]."""
        ramp = self.ramp_share * (self.end - self.start)
        inner = {self.start + ramp, self.end - ramp}
        return (self.start, *sorted(inner), self.end)
