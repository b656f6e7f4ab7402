"""Interleaved rounds: whatever else the machine does hits all subjects alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array


@dataclass(frozen=True)
class Quartiles:
    """Lower quartile, median and upper quartile of a sample."""

    low: float
    median: float
    high: float

    @classmethod
    def of(cls, values: Array) -> Quartiles:
        """Return the quartiles of a sample of any size above 0."""
        low, median, high = np.quantile(values, [0.25, 0.5, 0.75])
        return cls(float(low), float(median), float(high))

    def text(self, form: str = ".2f") -> str:
        """Return "median (low to high)"."""
        return f"{self.median:{form}} ({self.low:{form}} to {self.high:{form}})"


def interleaved(subjects: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, Array]:
    """Run every subject once a round, in turn, every other round backwards.

    One round before the first warms up and is not counted.

    Args:
        subjects: what runs once and returns what it measured, by name; put next to each other what
            is to be compared.
        rounds: how many counted rounds.

    Returns:
        The values of every name, one per round. Shape (rounds,) each.
    """
    found: dict[str, list[float]] = {name: [] for name in subjects}
    for k in range(rounds + 1):
        for name in list(subjects)[:: -1 if k % 2 else 1]:
            found[name].append(subjects[name]())
    return {name: np.array(values[1:]) for name, values in found.items()}
