"""Phase tables of gaits: when each foot is placed, as a fraction of the cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

MIN_FEET_DOWN = 3
"""A robot on fewer feet than this falls."""

MIN_WAVE_DUTY = 0.5
"""Smallest duty of a wave gait of six legs."""

PHASE_TOLERANCE = 1e-9
"""Phases closer than this are one event [cycles]."""


def wave_phases(duty: float) -> tuple[float, ...]:
    """Return the placements frac(m duty) of the m-th leg from the front, right side + 1/2.

    The wave gait of Song and Waldron, legs lf lm lr rf rm rr.
    """
    left = [_fraction(m * duty) for m in range(3)]
    return tuple(left + [_fraction(phase + 0.5) for phase in left])


def smallest_duty(phases: ArrayLike) -> float:
    """Return the smallest duty that keeps three feet down at any time with these placements."""
    return float(np.sort(age_at_placements(phases), axis=1)[:, MIN_FEET_DOWN - 1].max())


def age_at_placements(phases: ArrayLike) -> NDArray[np.float64]:
    """Return the time since each foot's placement, just before each leg's placement.

    The number of feet down is smallest just before a placement, so these instants decide.

    Returns:
        Row j, column i: age of foot i just before leg j is placed, in (0, 1]. Shape (6, 6).
    """
    placed = np.asarray(phases, dtype=float)
    age = np.mod(placed[:, None] - placed[None, :], 1.0)
    return np.where(age < PHASE_TOLERANCE, 1.0, age)


def _fraction(value: float) -> float:
    """Return the fractional part, with rounding just below 1 taken as 0."""
    part = float(np.mod(value, 1.0))
    return 0.0 if part > 1.0 - PHASE_TOLERANCE else part
