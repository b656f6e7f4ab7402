"""Normal and lognormal distributions, truncated where ends are given."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.sweep.study.distribution import Distribution, require_order
from hexapod_pin.sweep.study.fields import Number

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
    def z(self, value: float) -> float:
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
        """Where it is truncated, in words."""
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

    def z(self, value: float) -> float:
        """Return (x - mean) / deviation."""
        return (value - self.mean) / self.deviation

    def quantile(self, share: Array) -> Array:
        """Return mean + deviation z."""
        return self.mean + self.deviation * self.normal(share)

    @property
    def text(self) -> str:
        """The distribution in words."""
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

    def z(self, value: float) -> float:
        """Return ln(x / median) / ln(factor)."""
        if value <= 0.0:
            return -math.inf
        return math.log(value / self.median) / math.log(self.factor)

    def quantile(self, share: Array) -> Array:
        """Return median factor^z."""
        return np.asarray(self.median * self.factor ** self.normal(share))

    @property
    def text(self) -> str:
        """The distribution in words."""
        return f"lognormal {self.median:g} */ {self.factor:g}{self.truncation}"
