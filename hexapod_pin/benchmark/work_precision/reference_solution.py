"""The reference of a task: the tightest run there is, checked by another method."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from hexapod_pin.benchmark.work_precision.entry import ReferenceSolution, RunOutcome
from hexapod_pin.benchmark.work_precision.own_entry import run_task
from hexapod_pin.benchmark.work_precision.task import Task
from hexapod_pin.errors import HexapodError, UserCodeError
from hexapod_pin.simulation.methods import METHODS
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import SolverSetting

MAX_ATTEMPT_WALL = 120.0
"""Longest wall time of one attempt [s]."""

CHOICES = (
    (SolverSetting("dop853", 1e-10), SolverSetting("dop853", 1e-9), SolverSetting("dop853", 1e-8)),
    (SolverSetting("ndf", 1e-9), SolverSetting("ndf", 1e-8)),
    (SolverSetting("extrapolated-euler", 1e-8),),
    (SolverSetting("rk4", 5e-6),),
    (SolverSetting("rk4", 1e-5),),
)
"""The first two lines that give a result are the reference and its check. Explicit DOP853 shares
no Jacobian and no linear solver with the other adaptive methods."""


class NoReferenceError(HexapodError):
    """No method could give a reference for a task, or only one could."""


class _TooSlowError(Exception):
    """A reference run takes too long."""


def find_reference(task: Task, *, max_wall: float = MAX_ATTEMPT_WALL) -> ReferenceSolution:
    """Return the reference of a task with its own uncertainty.

    Args:
        task: the problem.
        max_wall: wall time [s] after which an attempt is given up for the next method.

    Raises:
        NoReferenceError: fewer than two methods reached the end; says what each did.
    """
    told: list[str] = []
    good: list[tuple[SolverSetting, RunOutcome]] = []
    for setting, outcome in _attempts(task, max_wall, told):
        good.append((setting, outcome))
        if len(good) == 2:
            (first, tightest), (second, check) = good
            uncertainty = tightest.distance(check)
            return ReferenceSolution(tightest, str(first), uncertainty, str(second))
    raise NoReferenceError(f"{task.name}: no reference with a check. {' '.join(told)}")


def known_answer(task: Task, reference: ReferenceSolution) -> float | None:
    """Return how far the reference is from the answer known from elsewhere; None without one."""
    if task.answer is None or reference.outcome.q is None:
        return None
    return PositionError.between(reference.outcome.q[-1:], task.answer[np.newaxis]).q


def _attempts(
    task: Task, max_wall: float, told: list[str]
) -> Iterator[tuple[SolverSetting, RunOutcome]]:
    """Yield the tightest run of every line of `CHOICES` that gives a result."""
    for line in CHOICES:
        for setting in line:
            if setting.method not in METHODS:
                continue
            try:
                outcome = run_task(task, setting, _time_limit(max_wall))
            except UserCodeError as error:
                if not isinstance(error.__cause__, _TooSlowError):
                    raise
                told.append(f"{setting}: more than {max_wall:g} s.")
                break
            if outcome.ended:
                yield setting, outcome
                break
            told.append(f"{setting}: {outcome.note}.")


def _time_limit(max_wall: float) -> Callable[[float], None]:
    """Return a progress callback that gives a run up in time."""
    end = time.perf_counter() + max_wall

    def look(_: float) -> None:
        if time.perf_counter() > end:
            raise _TooSlowError

    return look
