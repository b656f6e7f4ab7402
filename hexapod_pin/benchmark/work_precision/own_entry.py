"""Methods of this package run at their settings, and the tightest run is the reference solution."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hexapod_pin.benchmark.work_precision.measure import OURS, ReferenceSolution, RunOutcome
from hexapod_pin.benchmark.work_precision.task import Task
from hexapod_pin.errors import DivergenceError, HexapodError, SimulationInterrupted, UserCodeError
from hexapod_pin.simulation.case import simulate
from hexapod_pin.simulation.methods import METHODS
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import SolverSetting, divides

ACCURACIES = (1e-2, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 1e-7, 1e-8)
STEPS = (5e-3, 2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4, 5e-5, 2.5e-5, 1e-5)
"""[s]"""

QUICK_ACCURACIES = (1e-3, 1e-4, 1e-5)
QUICK_STEPS = (1e-3, 5e-4, 2.5e-4, 1e-4)


def sweep_settings(task: Task, method: str, *, quick: bool = False) -> list[SolverSetting]:
    """Return the settings of a method on a task, loosest first."""
    found = METHODS[method]
    if found.adaptive:
        accuracies = QUICK_ACCURACIES if quick else ACCURACIES
        values = [x for x in accuracies if found.tightest <= x <= found.loosest]
    else:
        values = [x for x in (QUICK_STEPS if quick else STEPS) if divides(x, task.sample)]
    return [SolverSetting(method, value) for value in values]


def kept_settings(
    task: Task, methods: Sequence[str], *, quick: bool = False
) -> list[SolverSetting]:
    """Return settings of the adaptive ones of some methods, the whole run's error controlled."""
    return [
        replace(setting, kept=True)
        for method in methods
        if METHODS[method].adaptive
        for setting in sweep_settings(task, method, quick=quick)
    ]


def run_task(
    task: Task, setting: SolverSetting, progress: Callable[[float], None] | None = None
) -> RunOutcome:
    """Run a task with one of our methods; divergence and refusal become a note."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            trace = simulate(
                task.scene, task.controller, duration=task.duration, sample=task.sample,
                initial=task.initial, progress=progress, **setting.arguments,
            )  # fmt: skip
        except SimulationInterrupted:
            raise
        except DivergenceError as error:
            wall = error.trace.run.wall_time or 0.0
            return RunOutcome.failed(f"diverged after {error.trace.time[-1]:.3g} s", wall)
        except UserCodeError:  # `progress` gives the run up
            raise
        except HexapodError as error:
            return RunOutcome.failed(f"refused: {error}")
    counters = trace.counters
    evaluations = counters.get("evaluations_of_all_runs", counters["evaluations"])
    return RunOutcome(
        places=trace.q[:, :3], q=trace.q, wall=(trace.run.wall_time or 0.0),
        evaluations=int(evaluations), steps=int(counters["steps"]),
        rejected=int(counters.get("rejected", 0)),
        estimate=trace.error_estimate,
        touches=int(np.count_nonzero(np.diff(trace.contact, axis=0))),
        note="; ".join(str(warning.message) for warning in caught),
    )  # fmt: skip


@dataclass(frozen=True)
class OwnEntry:
    """One of our methods on a task."""

    task: Task
    solver: SolverSetting
    reference: ReferenceSolution
    engine: str = OURS

    @property
    def method(self) -> str:
        """Name of the method, and whether the error of the whole run is controlled."""
        return self.solver.name

    @property
    def setting(self) -> str:
        """Its accuracy or step as text."""
        return self.solver.text

    @property
    def value(self) -> float:
        """Its accuracy [m, rad] or step [s]."""
        return self.solver.value

    def run(self) -> RunOutcome:
        """Run the task."""
        return run_task(self.task, self.solver)


# The reference of a task: the tightest run there is, checked by another method.

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
        NoReferenceError: fewer than two methods reached the end; the message lists what each did.
    """
    failures: list[str] = []
    good: list[tuple[SolverSetting, RunOutcome]] = []
    for setting, outcome in _attempts(task, max_wall, failures):
        good.append((setting, outcome))
        if len(good) == 2:
            (first, tightest), (second, check) = good
            uncertainty = tightest.distance(check)
            return ReferenceSolution(tightest, str(first), uncertainty, str(second))
    raise NoReferenceError(f"{task.name}: no reference with a check. {' '.join(failures)}")


def known_answer(task: Task, reference: ReferenceSolution) -> float | None:
    """Return how far the reference is from the answer known from elsewhere; None without one."""
    if task.answer is None or reference.outcome.q is None:
        return None
    return PositionError.between(reference.outcome.q[-1:], task.answer[np.newaxis]).q


def _attempts(
    task: Task, max_wall: float, failures: list[str]
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
                failures.append(f"{setting}: more than {max_wall:g} s.")
                break
            if outcome.ended:
                yield setting, outcome
                break
            failures.append(f"{setting}: {outcome.note}.")


def _time_limit(max_wall: float) -> Callable[[float], None]:
    """Return a progress callback that gives a run up in time."""
    end = time.perf_counter() + max_wall

    def look(_: float) -> None:
        if time.perf_counter() > end:
            raise _TooSlowError

    return look
