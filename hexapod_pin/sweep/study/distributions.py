"""Distributions of uncertain inputs, by their names in a study file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.sweep.study.distribution import Distribution, require_order
from hexapod_pin.sweep.study.fields import Number
from hexapod_pin.sweep.study.normal_distributions import LogNormal, Normal


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
        """The ends in words."""
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
        """Ends and mode in words."""
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
        """The values in words."""
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
