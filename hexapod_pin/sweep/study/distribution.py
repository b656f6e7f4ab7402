"""What every distribution of an uncertain input is: quantiles of points of the unit interval."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

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
        """The distribution in words, its truncation included."""

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
