"""A run is compared with a second one of another resolution, and refined until both agree."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Event
from typing import Any, TypeVar

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.log import LOG
from hexapod_pin.results.error_estimate import ErrorEstimate
from hexapod_pin.results.schema import differences
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.methods import ORDER
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.resolution import (
    CARRIED_FORCE_SHARE,
    CARRIED_NUMBER_SHARE,
    CARRIED_SHARE,
    JUMP,
    Comparison,
    next_level,
)
from hexapod_pin.simulation.run_outcome import run_numbers
from hexapod_pin.simulation.run_settings import RunSettings
from hexapod_pin.simulation.transients import Transients


@dataclass(frozen=True)
class _Ended:
    """A run that has ended well."""

    refinement: int
    run: NativeRun
    samples: Mapping[str, Array]
    numbers: Mapping[str, Any]
    own_error: ErrorEstimate | None
    own_errors: Mapping[str, Any]

    @classmethod
    def of(cls, refinement: int, run: NativeRun) -> _Ended:
        """Return a run with its samples, numbers and what it knows of its own errors."""
        numbers = run_numbers(run)
        if not run.follows_error:
            return cls(refinement, run, run.samples(), numbers, None, {})
        halves = [
            differences(Summary, numbers, dict.fromkeys(numbers) | half, CARRIED_NUMBER_SHARE)
            for half in run.rollout.half_summaries()
        ]
        errors = {name: np.fmax(one, halves[1].get(name, one)) for name, one in halves[0].items()}
        method = run.settings.method_settings.method.name
        force = CARRIED_FORCE_SHARE[method]
        shares = {"torque": force, "foot_force": force}
        error = ErrorEstimate(**{
            name: shares.get(name, CARRIED_SHARE[method]) * carried
            for name, carried in run.carried_error().items()
        })  # fmt: skip
        return cls(refinement, run, run.samples(), numbers, error, errors)

    @property
    def events(self) -> int:
        return int(self.run.rollout.counters()["events"])

    @property
    def amplifies(self) -> bool:
        """Whether the error carried along has grown too large for a linearised motion."""
        return bool(self.run.rollout.counters().get("error_lost"))

    @property
    def effort(self) -> int:
        return max(1, int(self.run.rollout.counters()["evaluations"]))


class AccuracyControl:
    """The runs of one case so far, and which is next.

    Attributes:
        settings: the settings requested.
        comparisons: of each run with the one before it.
        transients: of a walk until it repeats: what is left of them in its last cycle.
    """

    def __init__(
        self, settings: RunSettings, before: AccuracyControl | None = None, share: float = 1.0
    ) -> None:
        """Store the settings requested; nothing is run yet.

        Args:
            settings: the settings requested.
            before: the runs of the part of the motion before this one, whose work counts, too.
            share: of the accuracy requested, that the error of a run which knows it may take [-].
        """
        self.settings = settings
        self._allowed = share
        self.transients: Transients | None = None
        self._work = (0, 0.0) if before is None else before.work
        self.comparisons: list[Comparison] = []
        self._ended: list[_Ended] = []  # the two finest
        self._difference: ErrorEstimate | None = None  # of them
        self._contradicted = False  # what runs know of their errors
        self._diverged: list[NativeRun] = []
        self._taken: set[int] = set()  # levels
        self._level, self._runs, self._evaluations, self._wall_time = 0, 0, 0, 0.0

    def take(self, refinement: int, run: NativeRun, wall_time: float | None = None) -> None:
        """Compare a run that has ended with the finest one that ended well.

        Args:
            refinement: of the run.
            run: the run.
            wall_time: to count for it [s]; None: its own, of a run that ran alone.
        """
        self._level = max(self._level, refinement)
        self._taken.add(refinement)
        self._runs += 1
        self._evaluations += int(run.rollout.counters()["evaluations"])
        self._wall_time += run.wall_time if wall_time is None else wall_time
        LOG.debug("a run at refinement %d has taken %.3g s", refinement, run.wall_time)
        if not run.good:
            self._diverged.append(run)
            return
        ended = [*self._ended, _Ended.of(refinement, run)]
        self._ended = sorted(ended, key=lambda one: one.refinement)[-2:]
        if len(self._ended) == 2:
            self._compare(*self._ended)

    def _compare(self, coarser: _Ended, finer: _Ended) -> None:
        """Find what two runs differ by, and whether their own errors explain it."""
        self._difference = ErrorEstimate.between(finer.samples, coarser.samples, 1.0)
        ratio = self._ratio(self._difference)
        found = Comparison(
            coarser.refinement, finer.refinement, ratio,
            events=(coarser.events, finer.events), effort=finer.effort / coarser.effort,
            order=ORDER.get(self.settings.method_settings.method.name, 0),
            slow=self.settings.method_settings.slow_decay, amplifies=finer.amplifies,
        )  # fmt: skip
        LOG.debug("refinements %d and %d differ by %.3g of the accuracy",
                  coarser.refinement, finer.refinement, ratio)  # fmt: skip
        self.comparisons.append(found.after(self.comparisons[-1] if self.comparisons else None))
        own = [self._ratio(run.own_error) for run in (coarser, finer) if run.own_error is not None]
        self._contradicted |= len(own) == 2 and ratio > sum(own)

    def _ratio(self, error: ErrorEstimate) -> float:
        """Return an error of the finest run over the accuracy requested [-]."""
        torque = self._chosen.samples.get("torque", np.zeros(1))
        largest = float(np.abs(torque).max(initial=0.0))
        return self.settings.method_settings.error_ratio(error, largest)

    def next_level(self) -> int | None:
        """Return the level of the next run; None where there is to be none.

        Raises:
            DivergenceError: the states of a run and of a finer one are no longer finite.
        """
        settings = self.settings.method_settings
        finest = settings.finest_level
        if self._kept:
            return None
        ended = bool(self._diverged) and bool(self._diverged[-1].rollout.ended_by)
        if self._runs == 1 and not (ended and settings.carries_error):
            first, second = settings.first_levels
            return second if math.isinf(self._own_ratio) else min(first + JUMP, finest)
        if ended:  # a finer one would be too
            if not self._ended:
                self._diverged[-1].require_good_so_far()
            return None
        if not self._ended and (len(self._diverged) > 1 or self._level >= finest):
            self._diverged[-1].require_good_so_far()
        if self.comparisons:
            diverged = self._level > self.comparisons[-1].finer
            return None if diverged else next_level(self.comparisons, finest, self._taken)
        return min(self._level + JUMP, finest) if self._level < finest else None

    def trace(self) -> Trace:
        """Return the trace of the finest run, with its error."""
        return self._chosen.run.trace(
            self._error, self._counters, self._numerics, self._number_errors
        )

    def summary(self) -> Summary:
        """Return its summary, with its errors."""
        return self._chosen.run.summary(self._counters, self._numerics, self._number_errors)

    @property
    def run(self) -> NativeRun | None:
        """The finest run that has ended well, if any."""
        return self._ended[-1].run if self._ended else None

    @property
    def numbers(self) -> Mapping[str, Any]:
        """The numbers of its summary."""
        return self._chosen.numbers

    @property
    def work(self) -> tuple[int, float]:
        """Evaluations and wall time [s] so far, those before included."""
        evaluations, wall_time = self._work
        return evaluations + self._evaluations, wall_time + self._wall_time

    @property
    def _chosen(self) -> _Ended:
        return self._ended[-1]

    @property
    def _own_ratio(self) -> float:
        """Error that the chosen run knows of itself over the accuracy [-]; inf: it knows none."""
        own = self._chosen.own_error if self._ended else None
        return math.inf if own is None or self._contradicted else self._ratio(own)

    @property
    def _kept(self) -> bool:
        """Whether the chosen run is within the accuracy requested."""
        compared = bool(self.comparisons) and self.comparisons[-1].kept
        kept = self._own_ratio <= self._allowed or compared
        if not kept or self.transients is None:
            return kept
        error = self._error
        return error is not None and self._ratio(error) <= 1.0

    @property
    def error_ratio(self) -> float:
        """Error of the chosen run alone over the accuracy requested [-]; inf: it is not known."""
        error = self._run_error
        return math.inf if error is None else self._ratio(error)

    @property
    def _knows_error(self) -> bool:
        """Whether the chosen run's own error is reported, and not the difference of two runs."""
        own = self._own_ratio
        compared = self.comparisons[-1].error_ratio if self.comparisons else math.inf
        return own <= 1.0 or (math.isfinite(own) and own <= compared)

    @property
    def _share(self) -> float:
        """Of the difference, that the chosen run's error is at most [-]."""
        return self.comparisons[-1].error_fraction

    @property
    def _run_error(self) -> ErrorEstimate | None:
        if self._knows_error:
            return self._chosen.own_error
        return self._difference and self._difference.scaled(self._share)

    @property
    def _error(self) -> ErrorEstimate | None:
        error = self._run_error
        if error is None or self.transients is None:
            return error
        return self.transients.left.added_to(error)

    @property
    def _counters(self) -> dict[str, int]:
        return {"runs": self._runs, "evaluations_of_all_runs": self.work[0]}

    @property
    def _numerics(self) -> dict[str, Any]:
        """What trace and summary report of the error: more `Numerics`, and the wall time."""
        error, left = self._error, self.transients
        return {
            "wall_time": self.work[1],
            "tolerance": self._chosen.run.settings.method_settings.tolerance,
            "accuracy_kept": self._kept,
            "error_estimate": None if error is None else float(error.position.max()),
            "cycles_run": left and left.cycles,
            "transients": left and left.left.position,
            "torque_transients": left and left.left.torque,
        }

    @property
    def _number_errors(self) -> dict[str, Any]:
        """Errors of the summary's numbers."""
        found: Mapping[str, Any] = {}
        if self._knows_error:
            found = self._chosen.own_errors
        elif self._difference is not None:
            coarser, finer = self._ended
            found = differences(Summary, finer.numbers, coarser.numbers, self._share)
        left = {} if self.transients is None else self.transients.numbers
        return {name: error + left.get(name, 0.0) for name, error in found.items()}


Outcome = TypeVar("Outcome")
Runs = Generator[NativeRun, None, Outcome]
"""Runs, each to be advanced to its end before the next is asked for; returns what they lead to."""


def controlled_runs(
    run: NativeRun, before: AccuracyControl | None = None, share: float = 1.0
) -> Runs[AccuracyControl]:
    """Yield the runs of a case, finer each time, until its accuracy is met; one without estimate.

    Args:
        run: of the case, not yet advanced; it may have the first level of resolution already.
        before: as of `AccuracyControl`.
        share: as of `AccuracyControl`.

    Raises:
        DivergenceError: the states of a run and of a finer one are no longer finite.
    """
    control = AccuracyControl(run.settings, before, share)
    if not run.settings.estimate:
        yield run
        control.take(0, run)
        return control
    level: int | None = run.settings.method_settings.first_levels[0]
    while level is not None:
        if run.settings.method_settings.refinement != level:
            run = run.with_settings(control.settings.at_level(level))
        yield run
        control.take(level, run)
        level = control.next_level()
    return control


# The case is run again, finer each time, until it meets the accuracy requested.
#
# The first two runs run side by side, each in a thread of its own. Their difference bounds the
# error of the finer one; where that is above the accuracy requested, a still finer run follows.

Progress = Callable[[float], None]
Runner = Callable[[RunSettings, Progress | None], NativeRun]
"""Runs a case to its end with given settings, and reports its progress."""


class _StoppedError(Exception):
    """The other run has failed."""


class ControlledRun:
    """One case, run until its estimated error is within the accuracy requested."""

    def __init__(self, settings: RunSettings, run: Runner, progress: Progress | None) -> None:
        """Store the settings requested and the function that runs the case."""
        self._settings, self._run, self._progress, self._shown = settings, run, progress, 0.0

    def outcome(self) -> AccuracyControl:
        """Run until the accuracy is met, or until finer runs would not help.

        Raises:
            DivergenceError: the states of a run and of a finer one are no longer finite.
            SimulationInterrupted: Ctrl-C; `.trace` holds the samples of the present run.
        """
        control = AccuracyControl(self._settings)
        begin = time.perf_counter()
        coarse, fine = self._settings.method_settings.first_levels
        if self._settings.method_settings.carries_error:
            control.take(coarse, self._at(coarse))
        else:
            coarser, finer_run = self._side_by_side(coarse, fine)
            control.take(coarse, coarser, 0.0)
            control.take(fine, finer_run, time.perf_counter() - begin)
        while (finer := control.next_level()) is not None:
            control.take(finer, self._at(finer))
        return control

    def _side_by_side(self, coarse: int, fine: int) -> tuple[NativeRun, NativeRun]:
        stop = Event()

        def check(_: float) -> None:
            if stop.is_set():
                raise _StoppedError

        with ThreadPoolExecutor(1) as pool:
            try:
                companion = pool.submit(self._run, self._settings.at_level(coarse), check)
            except RuntimeError:  # the system starts no more threads: one after the other
                return self._run(self._settings.at_level(coarse), None), self._at(fine)
            try:
                run = self._at(fine)
            except BaseException:
                stop.set()
                raise
            return companion.result(), run

    def _at(self, refinement: int) -> NativeRun:
        return self._run(self._settings.at_level(refinement), self._tell)

    def _tell(self, fraction: float) -> None:
        """Report the progress, which never falls, though a finer run begins again at 0."""
        self._shown = max(self._shown, fraction)
        if self._progress is not None:
            self._progress(self._shown)
