"""Functions of time as data: sine, and a smooth curve through points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

PIECES_PER_PERIOD = 4
"""Pieces in which a polynomial of degree 10 follows a sine to 1e-11 of its amplitude."""


class Sine(Spec):
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

    @property
    def kinks(self) -> tuple[float, ...]:
        """Times at which a derivative jumps [s]."""
        return ()

    @property
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial [s]."""
        return self.period / PIECES_PER_PERIOD


class Waypoints(Spec):
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

    def _spline(self) -> BSpline:
        from scipy.interpolate import make_interp_spline

        rest = [(1, 0.0), (2, 0.0)]
        return make_interp_spline(self.time, self.value, k=5, bc_type=(rest, rest))

    @property
    def kinks(self) -> tuple[float, ...]:
        """Times at which a derivative jumps [s]."""
        return self.time

    @property
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial, from one point to the next [s]."""
        return float("inf")


TimeFunction = FiniteFloat | Annotated[Sine | Waypoints, Field(discriminator="kind")]
"""A constant or a function of time."""


def value_and_rate(function: float | Sine | Waypoints, time: Array) -> tuple[Array, Array]:
    """Return the value of a constant or function and its derivative at times [s]."""
    if isinstance(function, float | int):
        return np.full(np.shape(time), float(function)), np.zeros(np.shape(time))
    return function.value_and_rate(time)
