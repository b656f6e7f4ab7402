"""Switches there and back within a step of an integrator that looks at its ends only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq

SHARES = (0.25, 0.5, 0.75)
"""Places within a step at which the switching functions are looked at."""

ROOT_TOLERANCE = 4.0 * float(np.finfo(float).eps)
"""Relative, of the time of a switch; that of `solve_ivp`."""


def first_within(solution: Any, events: Sequence[Callable[..., float]]) -> float | None:
    """Return the first time [s] at which an event falls below 0 within a step; None: nowhere.

    Args:
        solution: SciPy's `OdeSolution` of the run.
        events: functions of time and state that are not below 0 at its start.
    """
    for begin, end in pairwise(solution.ts):
        for share in SHARES:
            time = begin + share * (end - begin)
            state = solution(time)
            below = [event for event in events if event(time, state) < 0.0]
            if below:
                return min(_root(event, solution, begin, time) for event in below)
    return None


def _root(event: Callable[..., float], solution: Any, begin: float, end: float) -> float:
    if event(begin, solution(begin)) <= 0.0:
        return float(begin)
    return float(
        brentq(lambda t: event(t, solution(t)), begin, end, xtol=1e-15, rtol=ROOT_TOLERANCE)
    )
