"""Phase tables of gaits: when each foot is placed, as a fraction of the cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

MIN_FEET_DOWN = 3
"""A robot on fewer feet than this falls."""

PHASE_TOLERANCE = 1e-9
"""Phases closer than this are one event [cycles]."""


def smallest_wave_duty(legs: int) -> float:
    """Return the smallest duty of a wave gait: three feet are down at any time."""
    return MIN_FEET_DOWN / legs


def usual_wave_duty(legs: int) -> float:
    """Return the duty of a wave gait where none is given: at most one foot is in the air.

    With four legs 5/6 and not 3/4, at which the longitudinal stability margin of the wave gait,
    (duty - 3/4) stroke / duty, is zero (McGhee and Frank 1968).
    """
    return max(5.0 / 6.0, (legs - 1.0) / legs)


def wave_phases(duty: float, legs: int = 6) -> tuple[float, ...]:
    """Return the placements of a wave gait, legs left front to rear, then right front to rear.

    With an even number of legs frac(m duty) of the m-th leg from the front, right side + 1/2: the
    wave gait of Song and Waldron. With an odd number even phases around the robot, from the front
    over the left to the rear and back on the right.
    """
    side = (legs + 1) // 2
    if legs % 2:
        around = [*range(side), *reversed(range(side, legs))]
        return tuple(m / legs for m in around)
    left = [_fraction(m * duty) for m in range(side)]
    return tuple(left + [_fraction(phase + 0.5) for phase in left])


def smallest_duty(phases: ArrayLike) -> float:
    """Return the smallest duty that keeps three feet down at any time with these placements."""
    return float(np.sort(age_at_placements(phases), axis=1)[:, MIN_FEET_DOWN - 1].max())


def age_at_placements(phases: ArrayLike) -> NDArray[np.float64]:
    """Return the time since each foot's placement, just before each leg's placement.

    The number of feet down is smallest just before a placement, so these instants decide.

    Returns:
        Row j, column i: age of foot i just before leg j is placed, in (0, 1]. Shape (L, L).
    """
    placed = np.asarray(phases, dtype=float)
    age = np.mod(placed[:, None] - placed[None, :], 1.0)
    return np.where(age < PHASE_TOLERANCE, 1.0, age)


def _fraction(value: float) -> float:
    """Return the fractional part, with rounding just below 1 taken as 0."""
    part = float(np.mod(value, 1.0))
    return 0.0 if part > 1.0 - PHASE_TOLERANCE else part
