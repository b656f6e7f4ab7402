"""Finer and finer runs of one case, until the error of the last is within what was asked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.error_estimate import ErrorEstimate
from hexapod_pin.results.number_errors import number_errors
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.resolution import ERROR_SHARE, Attempt, next_level
from hexapod_pin.simulation.run_settings import RunSettings

FIRST_LEVELS = (0, 1)


class AccuracyControl:
    """What runs of one case have come to, and which is next.

    Attributes:
        how: the settings asked for.
        attempts: runs that were compared with the one before.
        last: the finest run that ended well; None where none has.
    """

    def __init__(self, how: RunSettings) -> None:
        """Take the settings asked for; nothing is run yet."""
        self.how = how
        self.attempts: list[Attempt] = []
        self.last: NativeRun | None = None
        self._level, self._good_level = 0, 0
        self._samples: Mapping[str, Array] = {}
        self._numbers: Mapping[str, Any] = {}
        self._error: ErrorEstimate | None = None
        self._number_errors: dict[str, Any] = {}
        self._diverged: list[NativeRun] = []
        self._runs, self._evaluations, self._wall_time = 0, 0, 0.0

    def take(self, level: int, run: NativeRun) -> None:
        """Compare a run that has ended with the last one that ended well."""
        self._level = level
        self._runs += 1
        self._evaluations += int(run.rollout.counters()["evaluations"])
        self._wall_time += run.wall_time
        if not run.good:
            self._diverged.append(run)
            return
        samples, numbers = run.samples(), run.numbers()
        if self.last is not None:
            share = ERROR_SHARE[min(level - self._good_level, max(ERROR_SHARE))]
            self._error = ErrorEstimate.between(samples, self._samples, share)
            self._number_errors = number_errors(numbers, self._numbers, share)
            largest = np.abs(samples["torque"]).max(initial=0.0) if "torque" in samples else 0.0
            excess = self.how.choice.excess(self._error, float(largest))
            self.attempts.append(Attempt(level, excess, excess / share))
        self.last, self._samples, self._numbers = run, samples, numbers
        self._good_level = level

    def next_level(self) -> int | None:
        """Return the level of the next run; None where the last will do or none would help.

        Raises:
            DivergenceError: a run and a finer one have left the finite world.
        """
        finest = self.how.choice.finest_level
        if self.last is None and (len(self._diverged) > 1 or self._level >= finest):
            self._diverged[-1].require_good_so_far()
        if self.attempts:
            return next_level(self.attempts, finest)
        return min(self._level + max(ERROR_SHARE), finest) if self._level < finest else None

    def trace(self) -> Trace:
        """Return the trace of the finest run, with its error."""
        assert self.last is not None
        return self.last.trace(self._error, self._counters(), self._meta())

    def summary(self, *, texts: bool = True) -> Summary:
        """Return the summary of the finest run, with its errors; texts as of `NativeRun`."""
        assert self.last is not None
        summary = self.last.summary(texts=texts)
        counters = {**summary.counters, **self._counters()}
        meta = {**summary.meta, **self._meta()}
        return Summary.from_data(
            summary.data, summary.joint_names, summary.foot_names, counters, meta
        )

    def _counters(self) -> dict[str, int]:
        return {"runs": self._runs, "evaluations_of_all_runs": self._evaluations}

    def _meta(self) -> dict[str, Any]:
        """Return what trace and summary tell of the error."""
        assert self.last is not None
        known = self._error is not None
        return {
            "wall_time": self._wall_time,
            "tolerance": self.last.how.choice.tolerance,
            "accuracy_kept": bool(self.attempts and self.attempts[-1].kept),
            **({"error_estimate": float(self._error.position.max())} if self._error else {}),
            **({"number_errors": self._number_errors} if known else {}),
        }
