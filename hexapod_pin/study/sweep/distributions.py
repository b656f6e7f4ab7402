"""An uncertain input has a distribution, named in the study file."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec
from hexapod_pin.study.sweep.fields import Number
from hexapod_pin.type_checks import Unbounded

# What every distribution of an uncertain input is: quantiles of points of the unit interval.

DIGITS = 12
"""Significant digits of drawn numbers: the same on machines whose logarithms differ in the last."""

INSIDE = 2.0**-40
"""How far quantiles stay from 0 and 1, where a normal distribution has no value."""


class Distribution(Spec):
    """What an uncertain input follows."""

    @property
    @abstractmethod
    def support(self) -> tuple[float, float]:
        """Smallest and largest value; infinite where there is none."""

    @property
    @abstractmethod
    def text(self) -> str:
        """The distribution as text, its truncation included."""

    @abstractmethod
    def quantile(self, share: Array) -> Array:
        """Return the values below which these shares of all lie."""

    def draw(self, share: Array) -> list[float | str]:
        """Return the values at points of the unit interval, to 12 significant digits."""
        low, high = self.support
        found = self.quantile(np.clip(share, INSIDE, 1.0 - INSIDE))
        return [min(max(float(f"{x:.{DIGITS}g}"), low), high) for x in found.tolist()]


def require_order(owner: Spec, low: str, high: str) -> None:
    """Refuse ends that are not in order.

    Raises:
        ParameterError: the lower one is not below the upper one.
    """
    first, last = getattr(owner, low), getattr(owner, high)
    if not first < last:
        name = f"{type(owner).__name__}.{high}"
        raise ParameterError(name, last, f"above {low} = {first:g}")


# Normal and lognormal distributions, truncated where ends are given.

Positive = Annotated[Number, Field(gt=0.0)]

LEAST_SHARE = 1e-6
"""Least share of a normal distribution between the ends of its truncation."""


class Truncated(Distribution):
    """A distribution of a normal variable z, cut off where ends are given.

    Attributes:
        low: smallest value; None: none.
        high: largest value; None: none.
    """

    low: Number | None = None
    high: Number | None = None

    def __init__(self, /, **fields: Any) -> None:
        """Check the ends.

        Raises:
            ParameterError: low is not below high, or nothing to speak of lies between them.
        """
        super().__init__(**fields)
        if self.low is not None and self.high is not None:
            require_order(self, "low", "high")
        first, last = self._shares()
        if last - first < LEAST_SHARE:
            name, value = ("high", self.high) if self.high is not None else ("low", self.low)
            raise ParameterError(
                f"{type(self).__name__}.{name}", value,
                f"where at least {LEAST_SHARE:g} of the distribution lies between low and high",
            )  # fmt: skip

    @property
    def support(self) -> tuple[float, float]:
        """The ends of the truncation."""
        low = -math.inf if self.low is None else self.low
        return low, math.inf if self.high is None else self.high

    @abstractmethod
    def z(self, value: Unbounded) -> float:
        """Return the normal variable of a value."""

    def _shares(self) -> tuple[float, float]:
        """Return which shares of the whole distribution lie below the ends."""
        from scipy.special import ndtr

        low, high = self.support
        return float(ndtr(self.z(low))), float(ndtr(self.z(high)))

    def normal(self, share: Array) -> Array:
        """Return the normal variable at shares of what lies between the ends."""
        from scipy.special import ndtri

        first, last = self._shares()
        return np.asarray(ndtri(first + share * (last - first)))

    @property
    def truncation(self) -> str:
        """The truncation as text."""
        given = {"below": self.low, "above": self.high}
        ends = [f"{side} {end:g}" for side, end in given.items() if end is not None]
        return f", truncated {' and '.join(ends)}" if ends else ""


class Normal(Truncated):
    """The normal distribution, truncated where ends are given.

    Attributes:
        mean: of the whole distribution, before it is truncated.
        deviation: standard deviation, likewise.
    """

    mean: Number
    deviation: Positive

    def z(self, value: Unbounded) -> float:
        """Return (x - mean) / deviation."""
        return (value - self.mean) / self.deviation

    def quantile(self, share: Array) -> Array:
        """Return mean + deviation z."""
        return self.mean + self.deviation * self.normal(share)

    @property
    def text(self) -> str:
        """The distribution as text."""
        return f"normal {self.mean:g} +- {self.deviation:g}{self.truncation}"


class LogNormal(Truncated):
    """A value whose logarithm is normal: 68 % lie between median / factor and median * factor.

    Attributes:
        median: half of the values are below [the input's unit].
        factor: of one standard deviation of the logarithm, above 1 [-].
    """

    median: Positive
    factor: Annotated[Number, Field(gt=1.0)]

    @property
    def support(self) -> tuple[float, float]:
        """The ends of the truncation; never below 0."""
        low, high = super().support
        return max(low, 0.0), high

    def z(self, value: Unbounded) -> float:
        """Return ln(x / median) / ln(factor)."""
        if value <= 0.0:
            return -math.inf
        return math.log(value / self.median) / math.log(self.factor)

    def quantile(self, share: Array) -> Array:
        """Return median factor^z."""
        return np.asarray(self.median * self.factor ** self.normal(share))

    @property
    def text(self) -> str:
        """The distribution as text."""
        return f"lognormal {self.median:g} */ {self.factor:g}{self.truncation}"


# Distributions of uncertain inputs, by their names in a study file.


class Uniform(Distribution):
    """Any value between two alike.

    Attributes:
        low: the smallest.
        high: the largest.
    """

    low: Number
    high: Number

    def __init__(self, /, **fields: Any) -> None:
        """Check the ends.

        Raises:
            ParameterError: low is not below high.
        """
        super().__init__(**fields)
        require_order(self, "low", "high")

    @property
    def support(self) -> tuple[float, float]:
        """The ends."""
        return self.low, self.high

    @property
    def text(self) -> str:
        """The ends as text."""
        return f"uniform {self.low:g} to {self.high:g}"

    def quantile(self, share: Array) -> Array:
        """Return low + u (high - low)."""
        return self.low + share * (self.high - self.low)


class Triangular(Distribution):
    """A most likely value, and the two ends at which the density is nil.

    Attributes:
        low: the smallest.
        mode: the most likely.
        high: the largest.
    """

    low: Number
    mode: Number
    high: Number

    def __init__(self, /, **fields: Any) -> None:
        """Check the order.

        Raises:
            ParameterError: low is not below high, or the mode is not between them.
        """
        super().__init__(**fields)
        require_order(self, "low", "high")
        if not self.low <= self.mode <= self.high:
            allowed = f"from low = {self.low:g} to high = {self.high:g}"
            raise ParameterError("Triangular.mode", self.mode, allowed)

    @property
    def support(self) -> tuple[float, float]:
        """The ends."""
        return self.low, self.high

    @property
    def text(self) -> str:
        """Ends and mode as text."""
        return f"triangular {self.low:g} to {self.high:g}, most likely {self.mode:g}"

    def quantile(self, share: Array) -> Array:
        """Return the inverse of the two parabolas of the distribution function."""
        width = self.high - self.low
        split = (self.mode - self.low) / width
        below = self.low + np.sqrt(share * width * (self.mode - self.low))
        above = self.high - np.sqrt((1.0 - share) * width * (self.high - self.mode))
        return np.where(share < split, below, above)


class Choice(Distribution):
    """One of some values, each as likely.

    Attributes:
        values: numbers or names.
    """

    values: Annotated[tuple[Number | str, ...], Field(min_length=1)]

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest number; nothing known of names."""
        numbers = [x for x in self.values if not isinstance(x, str)]
        return (min(numbers), max(numbers)) if numbers else (-math.inf, math.inf)

    @property
    def text(self) -> str:
        """The values as text."""
        return "one of " + ", ".join(x if isinstance(x, str) else f"{x:g}" for x in self.values)

    def quantile(self, share: Array) -> Array:
        """Return the places of the values."""
        count = len(self.values)
        return np.minimum(np.floor(count * share), count - 1)

    def draw(self, share: Array) -> list[float | str]:
        """Return the values at points of the unit interval."""
        return [self.values[int(k)] for k in self.quantile(share)]


DISTRIBUTIONS: Mapping[str, type[Distribution]] = {
    "uniform": Uniform,
    "normal": Normal,
    "lognormal": LogNormal,
    "triangular": Triangular,
    "choice": Choice,
}
"""The distributions by their names in a study file."""
