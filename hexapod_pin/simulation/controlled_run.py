"""A run that keeps the accuracy asked for: the case again, finer each time, and compared.

The first two runs go on side by side, each in a thread of its own. What they differ by says how far
the finer one may be from the exact motion; where that is more than was asked, a still finer one
follows.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from threading import Event

from hexapod_pin.simulation.accuracy_control import AccuracyControl
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.run_settings import RunSettings

Progress = Callable[[float], None]
Runner = Callable[[RunSettings, Progress | None], NativeRun]
"""Runs a case to its end with given settings, telling its progress."""


class _StoppedError(Exception):
    """The companion of a run that is given up."""


class ControlledRun:
    """One case, run until its estimated error is within what was asked."""

    def __init__(self, how: RunSettings, run: Runner, progress: Progress | None) -> None:
        """Take the settings asked for and what runs the case; nothing is run yet."""
        self._how, self._run, self._progress, self._shown = how, run, progress, 0.0

    def outcome(self) -> AccuracyControl:
        """Run until the accuracy is kept, or until finer runs would not help.

        Raises:
            DivergenceError: a run and a finer one have left the finite world.
            SimulationInterrupted: Ctrl-C; `.trace` holds what the run under way had done.
        """
        control = AccuracyControl(self._how)
        begin = time.perf_counter()
        coarse, fine = self._how.choice.first_levels
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
                companion = pool.submit(self._run, self._how.at_level(coarse), check)
            except RuntimeError:  # the system starts no more threads: one after the other
                return self._run(self._how.at_level(coarse), None), self._at(fine)
            try:
                run = self._at(fine)
            except BaseException:
                stop.set()
                raise
            return companion.result(), run

    def _at(self, level: int) -> NativeRun:
        return self._run(self._how.at_level(level), self._tell)

    def _tell(self, fraction: float) -> None:
        """Tell the progress, which never falls: a finer run begins anew."""
        self._shown = max(self._shown, fraction)
        if self._progress is not None:
            self._progress(self._shown)
