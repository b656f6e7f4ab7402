"""The runs of a batch: a few planned ahead of the threads, each let go as soon as it is done."""

from __future__ import annotations

import contextlib
import json
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.errors import HexapodError, SimulationInterrupted
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.closed_loop import lock_step_runs
from hexapod_pin.simulation.native_run import PROGRESS_INTERVAL, NativeRun, open_loop_run

Result = tuple[int, Trace | Summary | Exception]
"""Index of a case, and what it came to."""

PATIENCE = 0.1
"""Time between two looks at the keyboard [s]."""

AHEAD = 2
"""Runs that wait for each thread: enough while Python makes a result and plans a case."""

SLICES = 16
"""Parts of a run that threads share, at least: so they end together."""

LOCK_STEP = 64
"""Most runs of one feedback controller side by side."""


class BatchRuns:
    """Cases under way. Open-loop ones run in the pool, the others in lock-step in this thread."""

    def __init__(self, cases: Sequence[Case | Exception], threads: int, record: bool) -> None:
        """Take the cases, or what forbids them; nothing is planned yet."""
        self.record = record
        self.cases = {k: case for k, case in enumerate(cases) if isinstance(case, Case)}
        self.refused = {k: case for k, case in enumerate(cases) if isinstance(case, Exception)}
        live = [k for k, c in self.cases.items() if isinstance(c.controller, FeedbackController)]
        self.open = deque(sorted(self.cases.keys() - set(live)))
        self.groups = deque(_groups(self.cases, live))
        self.threads = max(1, min(threads, len(self.open)))
        self.live_threads = threads

    def results(self) -> Iterator[Result]:
        """Yield results as cases finish."""
        from hexapod_pin import native as _native

        yield from self.refused.items()
        pool = _native.Batch(self.threads)
        under_way: dict[int, tuple[int, NativeRun, float]] = {}
        while self.open or self.groups or under_way:
            while self.open and len(under_way) < (AHEAD + 1) * self.threads:
                refused = self._plan_next(pool, under_way)
                if refused is not None:
                    yield refused
            if self.groups:
                yield from self._live(self.groups.popleft())
                continue
            number, good, failure = pool.next_done(PATIENCE)
            if number in under_way:
                index, run, begin = under_way.pop(number)
                run.good, run.wall_time = good, time.perf_counter() - begin
                yield index, RuntimeError(failure) if failure else self._result(run)

    def _plan_next(self, pool: Any, under_way: dict[int, tuple[int, NativeRun, float]]) -> Any:
        """Plan the next case and hand it to the pool; a case that is refused is a result."""
        index = self.open.popleft()
        begin = time.perf_counter()
        run = self._set_up(self.cases[index])
        if isinstance(run, Exception):
            return index, run
        grid = run.how.grid
        if self.record:
            run.rollout.reserve(grid.samples)
        part = min(round(PROGRESS_INTERVAL / grid.sample), grid.samples // SLICES)
        number = pool.add(run.rollout, grid.samples, max(1, part))
        under_way[number] = (index, run, begin)
        return None

    def _set_up(self, case: Case) -> NativeRun | Exception:
        """Plan a case; whatever forbids it is its result."""
        try:
            return open_loop_run(case, case.settings, record=self.record)
        except Exception as error:
            return _without_frames(error)

    def _live(self, group: list[int]) -> list[Result]:
        """Run cases with one feedback controller side by side; where that fails, one by one."""
        cases = [self.cases[k] for k in group]
        try:
            runs = lock_step_runs(
                cases, cases[0].settings, record=self.record, threads=self.live_threads
            )
        except SimulationInterrupted:
            raise
        except Exception as error:
            if len(group) == 1:
                return [(group[0], _without_frames(error))]
            return [result for k in group for result in self._live([k])]
        return [(k, self._result(run)) for k, run in zip(group, runs, strict=True)]

    def _result(self, run: NativeRun) -> Trace | Summary | Exception:
        """Return what a run came to."""
        try:
            if self.record:
                return run.require_good()
            run.require_good_so_far()
            return run.summary()
        except Exception as error:
            return _without_frames(error)


def _without_frames(error: Exception) -> Exception:
    """Return an error that, if it is one of this package, does not hold the run in memory."""
    return error.with_traceback(None) if isinstance(error, HexapodError) else error


def _groups(cases: Mapping[int, Case], live: Sequence[int]) -> list[list[int]]:
    """Return cases that can run in lock-step: one robot, controller, settings and start time."""
    found: dict[object, list[int]] = {}
    for k in live:
        found.setdefault(_lock_step_key(cases[k], k), []).append(k)
    return [
        group[start : start + LOCK_STEP]
        for group in found.values()
        for start in range(0, len(group), LOCK_STEP)
    ]


def _lock_step_key(case: Case, number: int) -> object:
    """Return what cases that run side by side share; a case that goes on is alone."""
    if isinstance(case.initial, Checkpoint) or case.duration is None:
        return number
    controller: object = id(case.controller)
    if hasattr(case.controller, "to_dict"):
        with contextlib.suppress(TypeError, ValueError):
            settings = json.dumps(case.controller.to_dict(), sort_keys=True)
            controller = (type(case.controller), settings)
    start_key = getattr(case.controller, "start_key", None)
    start = None if start_key is None else start_key(case.scene)
    return (controller, start, id(case.scene.robot), case.settings)
