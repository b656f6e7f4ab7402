"""Means and paired relative changes of repeated runs, with their confidence intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Estimate:
    """An estimate with its confidence interval.

    Attributes:
        value: the estimate.
        half_width: half of the interval's width; None of a single run, which has no interval.
        count: number of runs (or pairs of runs) behind it.
    """

    value: float
    half_width: float | None
    count: int

    def to_dict(self) -> dict[str, float | int | None]:
        """Return plain data."""
        return {"value": self.value, "half_width": self.half_width, "count": self.count}

    def differs_from(self, value: float) -> bool:
        """Tell whether the interval excludes a value; False without an interval."""
        return self.half_width is not None and abs(self.value - value) > self.half_width


def mean_estimate(values: Sequence[float]) -> Estimate | None:
    """Return the mean of independent runs; None of no runs.

    The interval is t s / sqrt(n), s with n - 1 degrees of freedom: exact for normal values.
    """
    if not values:
        return None
    return Estimate(float(np.mean(values)), _half_width(np.asarray(values)), len(values))


def relative_change(values: Sequence[float], baseline: Sequence[float]) -> Estimate | None:
    """Return the relative change of the mean, value / baseline - 1, of runs in pairs.

    The ratio estimator with its linearised variance: residuals are (x - r b) / mean(b), r the ratio
    of the means [Cochran1977, section 6.3], so that what a terrain does to both runs of a pair
    cancels. None of no pairs, or of a mean baseline of 0.
    """
    x, b = np.asarray(values, dtype=float), np.asarray(baseline, dtype=float)
    if len(x) == 0 or not (scale := float(np.mean(b))):
        return None
    ratio = float(np.mean(x)) / scale
    residual = (x - ratio * b) / scale
    return Estimate(ratio - 1.0, _half_width(residual), len(x))


def _half_width(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float | None:
    """Return half of the confidence interval of a mean; None of a single value."""
    from scipy.special import stdtrit

    count = len(values)
    if count < 2:
        return None
    quantile = float(stdtrit(count - 1, 0.5 * (1.0 + CONFIDENCE)))
    return quantile * float(np.std(values, ddof=1)) / math.sqrt(count)
