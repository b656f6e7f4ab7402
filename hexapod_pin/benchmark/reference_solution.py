"""The reference of a task: the tightest run there is, checked by another method."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from hexapod_pin.benchmark.entry import Outcome, Truth
from hexapod_pin.benchmark.error import Distance
from hexapod_pin.benchmark.settings import Setting, run_ours
from hexapod_pin.benchmark.task import Task
from hexapod_pin.errors import HexapodError
from hexapod_pin.simulation.methods import METHODS

PATIENCE = 120.0
"""Longest wall time of one attempt [s]."""

CHOICES = (
    (Setting("dop853", 1e-10), Setting("dop853", 1e-9), Setting("dop853", 1e-8)),
    (Setting("ndf", 1e-9), Setting("ndf", 1e-8)),
    (Setting("extrapolated-euler", 1e-8),),
    (Setting("rk4", 5e-6),),
    (Setting("rk4", 1e-5),),
)
"""The first two lines that give a result are the reference and its check. Explicit DOP853 shares
no Jacobian and no linear solver with the other adaptive methods."""


class NoReferenceError(HexapodError):
    """No method could give a reference for a task, or only one could."""


class _OutOfPatienceError(Exception):
    """A reference run takes too long."""


def reference(task: Task, *, patience: float = PATIENCE) -> Truth:
    """Return the reference of a task with its own uncertainty.

    Args:
        task: the problem.
        patience: wall time [s] after which an attempt is given up for the next method.

    Raises:
        NoReferenceError: fewer than two methods reached the end; says what each did.
    """
    told: list[str] = []
    good: list[tuple[Setting, Outcome]] = []
    for setting, outcome in _attempts(task, patience, told):
        good.append((setting, outcome))
        if len(good) == 2:
            (first, truth), (second, check) = good
            doubt = truth.distance(check)
            return Truth(truth, str(first), doubt, str(second))
    raise NoReferenceError(f"{task.name}: no reference with a check. {' '.join(told)}")


def known_answer(task: Task, truth: Truth) -> float | None:
    """Return how far the reference is from the answer known from elsewhere; None without one."""
    if task.answer is None or truth.outcome.q is None:
        return None
    return Distance.between(truth.outcome.q[-1:], task.answer[np.newaxis]).q


def _attempts(task: Task, patience: float, told: list[str]) -> Iterator[tuple[Setting, Outcome]]:
    """Yield the tightest run of every line of `CHOICES` that gives a result."""
    for line in CHOICES:
        for setting in line:
            if setting.method not in METHODS:
                continue
            try:
                outcome = run_ours(task, setting, _watch(patience))
            except _OutOfPatienceError:
                told.append(f"{setting}: more than {patience:g} s.")
                break
            if outcome.ended:
                yield setting, outcome
                break
            told.append(f"{setting}: {outcome.note}.")


def _watch(patience: float) -> Callable[[float], None]:
    """Return a progress callback that gives a run up in time."""
    end = time.perf_counter() + patience

    def look(_: float) -> None:
        if time.perf_counter() > end:
            raise _OutOfPatienceError

    return look
