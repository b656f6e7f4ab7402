"""Random numbers by the names of their distributions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np

from hexapod_pin.arrays import Array

T = TypeVar("T")


class Draws:
    """Draws from one generator; the same seeds give the same numbers."""

    def __init__(self, *seeds: int) -> None:
        """Start from non-negative integers."""
        self._generator = np.random.default_rng(list(seeds))

    def between(self, low: float, high: float) -> float:
        """Return a number, uniform in [low, high)."""
        return float(self._generator.uniform(low, high))

    def log_between(self, low: float, high: float) -> float:
        """Return a number whose logarithm is uniform, low above 0."""
        return math.exp(self.between(math.log(low), math.log(high)))

    def vector(self, half_width: float, *shape: int) -> Array:
        """Return an array of the shape, uniform in -half_width..half_width."""
        return np.asarray(self._generator.uniform(-half_width, half_width, shape))

    def chance(self, probability: float) -> bool:
        """Return True with a probability."""
        return self.between(0.0, 1.0) < probability

    def integer(self, low: int, high: int) -> int:
        """Return an integer of low..high - 1."""
        return int(self._generator.integers(low, high))

    def pick(self, items: Sequence[T]) -> T:
        """Return one of the items."""
        return items[self.integer(0, len(items))]

    def weighted(self, weights: Mapping[str, float]) -> str:
        """Return a name with a probability in proportion to its weight."""
        names, values = list(weights), np.array(list(weights.values()), dtype=float)
        return names[int(self._generator.choice(len(names), p=values / values.sum()))]
