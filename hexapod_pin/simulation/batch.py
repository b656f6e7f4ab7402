"""Many cases run on threads of the native core and come back in order."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sized
from dataclasses import dataclass
from typing import Any

from hexapod_pin.arguments import checked
from hexapod_pin.control.check_controller import method_name, settings_of
from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.errors import HexapodError, ParameterError, SimulationInterrupted, UserCodeError
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.accuracy_control import Runs
from hexapod_pin.simulation.case import Case, case_runs
from hexapod_pin.simulation.native_run import PROGRESS_INTERVAL, NativeRun
from hexapod_pin.simulation.run_settings import RunSettings, WorkLimits, chosen_limits
from hexapod_pin.simulation.session import controlled_loop, lock_step_runs
from hexapod_pin.user_code import UserCode, user_callback

MOST_THREADS = 1024
"""Largest number of threads accepted."""

BatchResult = Trace | Summary | Exception
"""The result of a case."""


@checked
def simulate_batch(
    cases: Iterable[Case],
    *,
    duration: float | None = None,
    accuracy: float | None = None,
    estimate: bool | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    threads: int = 1,
    keep: str = "trace",
    errors: str = "keep",
    limits: WorkLimits | None = None,
    allow: bool = False,
    progress: Callable[[float], None] | None = None,
) -> list[BatchResult]:
    """Run independent cases over threads; the bits do not depend on the number of threads.

    Args:
        cases: what to run. Settings below are for those that have none of their own.
        duration: simulated time [s].
        accuracy: as in `simulate` [m and rad].
        estimate: as in `simulate`; None: the setting of each case.
        method: as in `simulate`.
        step: as in `simulate` [s].
        sample: as in `simulate` [s].
        threads: how many run at a time, no more than there are cases. Feedback controllers run in
            one thread, and their runs advance on all threads between ticks.
        keep: "trace", or "summary": samples are not stored, so that thousands fit into memory.
        errors: "keep": a case that fails is an entry of the result; "raise": the error of the first
            case that failed is raised, after all have been run.
        limits: as in `simulate`, of each case.
        allow: as in `simulate`.
        progress: called with the finished fraction (0..1) as cases finish.

    Returns:
        In the order of the cases, of each its `Trace` or `Summary`, or its error: a
        `DivergenceError`, a `UserCodeError` of its controller, or what `simulate` refuses it with.

    Raises:
        ParameterError: threads, keep, errors or a setting out of range; or the system starts no
            more threads.
        SimulationInterrupted: Ctrl-C; `.results` holds the results so far, None for the rest.
        UserCodeError: `progress` has raised; it has `.results`, too.
    """
    if errors not in ("keep", "raise"):
        raise ParameterError("errors", errors, '"keep" or "raise"')
    chosen = list(cases)
    results: list[BatchResult | None] = [None] * len(chosen)
    done = iterate_batch(
        chosen, duration=duration, accuracy=accuracy, estimate=estimate, method=method, step=step,
        sample=sample, threads=threads, keep=keep, limits=limits, allow=allow,
    )  # fmt: skip
    report = user_callback("progress", progress)
    try:
        for count, (index, result) in enumerate(done, start=1):
            results[index] = result
            if report is not None:
                report(count / len(chosen))
    except UserCodeError as error:
        error.results = results
        raise
    except (KeyboardInterrupt, SimulationInterrupted):
        count = sum(result is not None for result in results)
        text = f"interrupted after {count} of {len(chosen)} cases"
        raise SimulationInterrupted(text, None, results) from None
    found = [result for result in results if result is not None]
    if errors == "raise":
        for result in found:
            if isinstance(result, Exception):
                raise result
    return found


@checked
def iterate_batch(
    cases: Iterable[Case | Exception],
    *,
    duration: float | None = None,
    accuracy: float | None = None,
    estimate: bool | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    threads: int = 1,
    keep: str = "trace",
    limits: WorkLimits | None = None,
    allow: bool = False,
) -> Iterator[tuple[int, BatchResult]]:
    """Yield the index and the result of each case as it finishes; arguments as `simulate_batch`.

    Cases are taken as threads need them, so that an iterator may make more than fit into memory.
    An exception among them is the result of its place. Closing the iterator abandons the rest.

    Raises:
        ParameterError: threads, keep or a setting out of range.
    """
    check_threads(threads)
    if keep not in ("trace", "summary"):
        raise ParameterError("keep", keep, '"trace" or "summary"')
    RunSettings.of(0.0 if duration is None else duration, method, accuracy, None, step, sample)
    settings: dict[str, Any] = dict(
        duration=duration, accuracy=accuracy, estimate=estimate, method=method, step=step,
        sample=sample, limits=chosen_limits(limits, allow) if limits or allow else None,
    )  # fmt: skip
    if isinstance(cases, Sized):
        threads = max(1, min(threads, len(cases)))
    settled = (_settled(case, settings) for case in cases)
    return BatchRuns(settled, threads, keep == "trace").results()


def check_threads(threads: object) -> None:
    """Refuse what is no number of threads.

    Raises:
        ParameterError: no whole number, or none between 1 and `MOST_THREADS`.
    """
    whole = isinstance(threads, int) and not isinstance(threads, bool)
    if not (whole and 1 <= threads <= MOST_THREADS):  # type: ignore[operator]  # whole
        raise ParameterError("threads", threads, f"a whole number from 1 to {MOST_THREADS}")


def _settled(case: Case | Exception, settings: Mapping[str, Any]) -> Case | Exception:
    """Return the case with the batch's settings for those that it leaves open."""
    if isinstance(case, Exception):
        return case
    if not isinstance(case, Case):  # of a generator, which no call looks into
        raise ParameterError("cases", case, "several of Case")
    try:
        return case.with_defaults(**settings)
    except ParameterError as error:  # they do not fit this case's own
        return error


# The runs of a batch: a few planned ahead of the threads, each released as soon as it is done.

Result = tuple[int, Trace | Summary | Exception]
"""Index of a case, and its result."""

PATIENCE = 0.1
"""Time between two checks for Ctrl-C [s]."""

AHEAD = 2
"""Runs that wait for each thread: enough while Python makes a result and plans a case."""

SLICES = 16
"""Least number of parts into which a run is cut for the threads: so they end together."""

LOCK_STEP = 64
"""Largest number of runs of one feedback controller side by side."""

MOST_WAITING = 4 * LOCK_STEP
"""Largest number of cases with feedback that wait for others like them."""


class BatchRuns:
    """Runs cases: open-loop ones in the pool, the others in lock-step in this thread.

    Cases are taken one by one, as threads need them; those with feedback wait for others that run
    beside them.
    """

    def __init__(
        self,
        cases: Iterable[Case | Exception],
        threads: int,
        record: bool,
    ) -> None:
        """Store the cases; nothing is planned yet. `record`: whether samples are recorded."""
        self.record, self.threads = record, threads
        self.cases = enumerate(cases)
        self.waiting: dict[object, dict[int, Case]] = {}  # with feedback, by what they share

    def results(self) -> Iterator[Result]:
        """Yield results as cases finish."""
        from hexapod_pin import native as _native

        try:
            pool = _native.Batch(self.threads)
        except RuntimeError as refusal:
            raise ParameterError("threads", self.threads, f"fewer: {refusal}") from None
        try:
            yield from self._results(pool)
        finally:
            pool.close()

    def _results(self, pool: Any) -> Iterator[Result]:
        """Yield the results of cases that a pool of the core runs, and of those with feedback."""
        under_way: dict[int, _Job] = {}
        more = True
        while more or self.waiting or under_way:
            while more and len(under_way) < (AHEAD + 1) * self.threads:
                index, case = next(self.cases, (-1, None))
                more = case is not None
                if isinstance(case, Exception):
                    yield index, case
                elif case is not None and isinstance(case.controller, FeedbackController):
                    yield from self._wait(index, case)
                elif case is not None:
                    job = self._plan(index, case)
                    if isinstance(job, Exception):
                        yield index, job
                    else:
                        under_way[self._hand_over(job, pool)] = job
            if self.waiting and not more:
                yield from self._live(self.waiting.pop(next(iter(self.waiting))))
                continue
            number, good, failure = pool.next_done(PATIENCE) if under_way else (None, False, "")
            if number in under_way:
                job = under_way.pop(number)
                job.run.good, job.run.wall_time = good, time.perf_counter() - job.begin
                result = RuntimeError(failure) if failure else self._ended(job)
                if result is None:
                    under_way[self._hand_over(job, pool)] = job
                else:
                    yield job.index, result

    def _wait(self, index: int, case: Case) -> list[Result]:
        """Add a case with feedback to those like it; run them where they are enough."""
        try:
            key = _lock_step_key(case, index)
        except Exception as error:
            return [(index, _without_frames(error))]
        self.waiting.setdefault(key, {})[index] = case
        if len(self.waiting[key]) < LOCK_STEP:
            if sum(map(len, self.waiting.values())) < MOST_WAITING:
                return []
            key = max(self.waiting, key=lambda one: len(self.waiting[one]))
        return self._live(self.waiting.pop(key))

    def _plan(self, index: int, case: Case) -> _Job | Exception:
        """Plan a case; an error is its result."""
        try:
            runs = case_runs(case, record=self.record)
            return _Job(index, runs, next(runs))
        except Exception as error:
            return _without_frames(error)

    def _hand_over(self, job: _Job, pool: Any) -> int:
        """Hand a run to the pool; return its number there."""
        grid = job.run.settings.grid
        if job.run.recorded:
            job.run.rollout.reserve(grid.samples)
        part = min(round(PROGRESS_INTERVAL / grid.sample), grid.samples // SLICES)
        job.begin = time.perf_counter()
        return int(pool.add(job.run.rollout, grid.samples, max(1, part)))

    def _ended(self, job: _Job) -> Trace | Summary | Exception | None:
        """Return the result of a case; None where another run of it, now the job's, is next."""
        try:
            job.run = next(job.runs)
        except StopIteration as end:
            result: Trace | Summary = end.value
            return result
        except Exception as error:
            return _without_frames(error)
        return None

    def _live(self, group: Mapping[int, Case]) -> list[Result]:
        """Run cases with one feedback controller side by side; where that fails, one by one."""
        cases = list(group.values())
        if cases[0].settings.estimate:
            return [(k, self._controlled(case)) for k, case in group.items()]
        try:
            runs = lock_step_runs(
                cases, cases[0].settings, record=self.record, threads=self.threads
            )
        except SimulationInterrupted:
            raise
        except Exception as error:
            if len(group) == 1:
                return [(index, _without_frames(error)) for index in group]
            return [result for k, case in group.items() for result in self._live({k: case})]
        return [(k, self._result(run)) for k, run in zip(group, runs, strict=True)]

    def _controlled(self, case: Case) -> Trace | Summary | Exception:
        """Return the result of a case with feedback whose error is controlled: it runs alone."""
        try:
            control = controlled_loop(case, record=self.record)
            return control.trace() if self.record else control.summary()
        except SimulationInterrupted:
            raise
        except Exception as error:
            return _without_frames(error)

    def _result(self, run: NativeRun) -> Trace | Summary | Exception:
        """Return the result of a run."""
        try:
            if self.record:
                return run.require_good()
            run.require_good_so_far()
            return run.summary()
        except Exception as error:
            return _without_frames(error)


@dataclass
class _Job:
    """A case in the pool: all its runs, and the one that is there."""

    index: int
    runs: Runs[Trace | Summary]
    run: NativeRun
    begin: float = 0.0


def _without_frames(error: Exception) -> Exception:
    """Return an error that, if it is one of this package, has no reference to the run."""
    return error.with_traceback(None) if isinstance(error, HexapodError) else error


def _lock_step_key(case: Case, number: int) -> object:
    """Return what cases that run side by side share; a case from a checkpoint runs alone.

    Raises:
        ParameterError: the case has no duration, or its controller's `start_key` is not hashable.
        UserCodeError: `to_dict` or `start_key` of its controller has raised.
    """
    settings = case.settings
    if isinstance(case.initial, Checkpoint):
        return number
    controller: object = id(case.controller)
    if hasattr(case.controller, "to_dict"):
        text = json.dumps(settings_of(case.controller), sort_keys=True, default=repr)
        controller = (type(case.controller), text)
    return (controller, _start_key(case), id(case.scene.robot), settings)


def _start_key(case: Case) -> object:
    """Return what the controller's `start` uses of the case's scene."""
    start_key = getattr(case.controller, "start_key", None)
    if start_key is None:
        return None
    call = method_name(case.controller, "start_key")
    with UserCode(call):
        key = start_key(case.scene)
    try:
        hash(key)
    except TypeError:
        raise ParameterError(call, type(key).__name__, "hashable") from None
    return key
