"""Functions of time as data: those of one piece, their sums and their repetition."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from hexapod_pin.arrays import Array
from hexapod_pin.control.curves import (
    Havsin,
    Hermite,
    MotionFunction,
    Sine,
    Step,
    Step5,
    VelocityStep,
    Waypoints,
)
from hexapod_pin.errors import ParameterError

SEAM_TOLERANCE = 1e-12
"""Largest jump at the seam of a repetition, as a share of 1 or of the value if that is larger."""

MAX_REPETITIONS = 1_000_000
"""Periods up to which the kinks of a repetition are listed."""


FARTHEST_START = 1e12
"""Periods from 0 within which a repetition begins: farther away the time of its kinks is lost."""


class Sum(MotionFunction):
    """The sum of functions of time and constants, as ADAMS motions are sums of STEPs.

    Attributes:
        terms: one or more, each a number or a function.
    """

    kind: Literal["sum"] = "sum"
    terms: tuple[TimeFunction, ...] = Field(min_length=1)

    def value_and_rate(self, time: Array) -> tuple[Array, Array]:
        """Return the value and its derivative at times [s], of their shape."""
        value, rate = np.zeros(np.shape(time)), np.zeros(np.shape(time))
        for term in self.terms:
            more, faster = value_and_rate(term, time)
            value, rate = value + more, rate + faster
        return value, rate

    def acceleration(self, time: Array, inside: Array | None = None) -> Array:
        """Return the second derivative; `inside` picks the piece where it jumps."""
        total = np.zeros(np.shape(time))
        for one in self._functions:
            total = total + one.acceleration(time, inside)
        return total

    def kinks_until(self, end: float) -> tuple[float, ...]:
        """Return the times at which a derivative of any term jumps [s]."""
        return tuple(sorted({kink for one in self._functions for kink in one.kinks_until(end)}))

    @property
    def shortest_time(self) -> float:
        """Time in which every term is close to a polynomial between kinks [s]."""
        return min((one.shortest_time for one in self._functions), default=float("inf"))

    @property
    def _functions(self) -> list[MotionFunction]:
        return [one for one in self.terms if isinstance(one, MotionFunction)]


class Periodic(MotionFunction):
    """A function, given from 0 to its period, that repeats without end in both directions.

    Attributes:
        function: what repeats; its values outside 0..period are not used.
        period: [s].
        start: a time at which a repetition begins [s].

    Raises:
        ParameterError: value or rate at the end of the period are not those at its begin.
    """

    kind: Literal["periodic"] = "periodic"
    function: Moving
    period: float = Field(gt=0.0)
    start: float = 0.0

    def __init__(self, /, **fields: Any) -> None:
        """Refuse a function that jumps from one period to the next."""
        super().__init__(**fields)
        ends = self.function.value_and_rate(np.array([0.0, self.period]))
        for name, (first, last) in zip(("value", "rate"), ends, strict=True):
            if abs(last - first) > SEAM_TOLERANCE * max(1.0, abs(first)):
                raise ParameterError(
                    f"Periodic.function.{name}", float(last),
                    f"{first:.9g} at its period, as at 0: it would jump by {first - last:.3g}",
                )  # fmt: skip

    def value_and_rate(self, time: Array) -> tuple[Array, Array]:
        """Return the value and its derivative at times [s], of their shape."""
        return self.function.value_and_rate(time - self._begin(time))

    def acceleration(self, time: Array, inside: Array | None = None) -> Array:
        """Return the second derivative; `inside` picks the piece where it jumps."""
        at = time if inside is None else inside
        begin = self._begin(at)
        return self.function.acceleration(time - begin, at - begin)

    def kinks_until(self, end: float) -> tuple[float, ...]:
        """Return the times from 0 to `end` at which a derivative may jump, seams included [s].

        Raises:
            ParameterError: there are more than MAX_REPETITIONS periods until then.
        """
        if not end >= 0.0:
            return ()
        if end > MAX_REPETITIONS * self.period:
            raise ParameterError(
                "Periodic.period",
                self.period,
                f"at least {end / MAX_REPETITIONS:g} s up to {end:g} s",
            )
        if abs(self.start) > FARTHEST_START * self.period:
            allowed = f"within {FARTHEST_START:g} periods of 0 s"
            raise ParameterError("Periodic.start", self.start, allowed)
        own = [k for k in self.function.kinks_until(self.period) if 0.0 < k < self.period]
        first = np.floor(-self.start / self.period)
        cycles = np.arange(first, np.floor((end - self.start) / self.period) + 1.0)
        times = self.start + cycles[:, None] * self.period + np.array([0.0, *own])
        return tuple(times[(times >= 0.0) & (times <= end)].tolist())

    @property
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial between kinks [s]."""
        return self.function.shortest_time

    def _begin(self, time: Array) -> Array:
        """Return when the repetitions that hold at times [s] begin [s]."""
        begin: Array = self.start + np.floor((time - self.start) / self.period) * self.period
        return begin


Moving = Annotated[
    Sine | Waypoints | Hermite | Step | Step5 | Havsin | VelocityStep | Sum | Periodic,
    Field(discriminator="kind"),
]
"""A function of time."""

TimeFunction = FiniteFloat | Moving
"""A constant or a function of time."""

Sum.model_rebuild()
Periodic.model_rebuild()


def value_and_rate(function: float | MotionFunction, time: Array) -> tuple[Array, Array]:
    """Return the value of a constant or function and its derivative at times [s]."""
    if isinstance(function, float | int):
        return np.full(np.shape(time), float(function)), np.zeros(np.shape(time))
    return function.value_and_rate(time)
