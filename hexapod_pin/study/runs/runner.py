"""Studies run many cases by a runner, which remembers their rows and survives being killed.

A study is a function of a `Runner` that requests rows of cases. With a store, each row is on the
disk as soon as its case is finished, under a key of its content. To resume is to run the study
again: known rows return at once. No state of the study itself is stored, so it must request the
same cases again: it uses no clock and no order in which cases finish.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypedDict, TypeVar, cast, overload

from hexapod_pin.arguments import checked
from hexapod_pin.errors import (
    ParameterError,
    SimulationInterrupted,
    StudyInterrupted,
    WorkersError,
)
from hexapod_pin.simulation.batch import check_threads, iterate_batch
from hexapod_pin.simulation.case import Case
from hexapod_pin.study.runs.measure import Measure
from hexapod_pin.study.runs.outcome import Outcome
from hexapod_pin.study.runs.task import NO_ROW, CaseList, case_outcomes
from hexapod_pin.user_code import user_callback

if TYPE_CHECKING:
    from hexapod_pin.study.runs.distribution import Sink
    from hexapod_pin.study.runs.store import RowStore, Store
    from hexapod_pin.study.runs.workers import Workers
    from hexapod_pin.study.sweep import SweepStudy

Row = TypeVar("Row")
Result = TypeVar("Result")

Progress = Callable[[float], None]
"""Called with the finished fraction (0..1)."""

THREADS = 2
"""Threads of the native core where cases run in this process."""

CHUNK = 4
"""Cases of a task for a worker: the most that the death of one worker loses."""

MOST_PROCESSES = 1024
"""Worker processes of one machine [-]."""


class RunOptions(TypedDict, total=False):
    """How a study is run; every study takes these, and gives the same bits with any of them.

    store: SQLite file that keeps every finished row; None: nothing is kept.
    resume: continue a store that exists: rows in it are not run again.
    retry_failed: continue, and run failed cases again.
    threads: of the native core; None: 2 in this process, 1 in each worker.
    processes: worker processes of this machine.
    executor: of `concurrent.futures`, or a function that makes one (and, where it breaks, another).
        A broken `ProcessPoolExecutor` is replaced.
    scheduler: address of a Dask scheduler, such as "tcp://10.0.0.1:8786".
    progress: called with the finished fraction (0..1).

    A controller that cannot be written as data runs on threads without a store only.
    """

    store: str | Path | None
    resume: bool
    retry_failed: bool
    threads: int | None
    processes: int | None
    executor: Executor | Callable[[], Executor] | None
    scheduler: str | None
    progress: Progress | None


@checked
class Rows(Sequence[Any], Generic[Row]):
    """Results of cases in their order: a row, an error, or None for a case that was not run."""

    def __init__(self, found: Sequence[Row | Exception | None]) -> None:
        """Store the results."""
        self._found = tuple(found)

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self._found)

    @overload
    def __getitem__(self, index: int) -> Row | Exception | None: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Row | Exception | None]: ...
    def __getitem__(self, index: int | slice) -> Any:
        """Return the result of a case, or of several."""
        return self._found[index]

    @property
    def complete(self) -> bool:
        """Whether every case was run."""
        return all(one is not None for one in self._found)

    def require_complete(self, lost: str = "") -> list[Row | Exception]:
        """Return the rows and errors of all cases, for a study that needs every one.

        Args:
            lost: description of what is missing without them.

        Raises:
            StudyInterrupted: a case was not run; `.result` holds the rows.
        """
        found = [one for one in self._found if one is not None]
        if len(found) < len(self):
            text = f"interrupted after {len(found)} of {len(self)} cases"
            raise StudyInterrupted(f"{lost}: {text}" if lost else text, self)
        return found


@checked
class Runner:
    """Runs cases on threads or workers, and remembers their rows where there is a store.

    Attributes:
        progress: called with the finished fraction of the study, or None.
        interrupted: whether Ctrl-C came: cases that are not known are not run any more.
        asked: how many rows were requested.
        finished: how many of them are known.
    """

    def __init__(
        self,
        *,
        store: Store | None = None,
        workers: Workers | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        """Take where cases run and where rows are kept; see `RunOptions`."""
        self.store, self.workers, self.progress = store, workers, progress
        self.threads = threads or (THREADS if workers is None else 1)
        self.interrupted = False
        self.asked = self.finished = 0

    def rows(
        self,
        cases: Iterable[Case | Exception],
        measure: Measure[Row] | Sequence[Measure[Row]],
        *,
        span: tuple[float, float] | None = (0.0, 1.0),
    ) -> Rows[Row]:
        """Return the rows of cases; after Ctrl-C, of those that are known.

        Args:
            cases: what to run. An exception takes the place of an impossible case, and is its row.
            measure: what is kept of each run; one, or one for each case.
            span: fractions of the study that are finished before and after these cases; None:
                no progress is reported.

        Raises:
            ParameterError: a controller cannot be written as data, with a store or workers.
            StoreFullError, SweepStoreError: rows cannot be kept; all before are.
            WorkersError: workers are gone or cannot run the cases; all that was finished is kept.
        """
        given = list(cases)
        measures = [measure] * len(given) if isinstance(measure, Measure) else list(measure)
        found: list[Any] = [case if isinstance(case, Exception) else None for case in given]
        places = [k for k, case in enumerate(given) if isinstance(case, Case)]
        listed = CaseList([cast("Case", given[k]) for k in places], [measures[k] for k in places])
        failed, total = len(given) - len(places), len(given)

        def report(done: int) -> None:
            if self.progress is not None and span is not None:
                self.progress(span[0] + (span[1] - span[0]) * ((failed + done) / total))

        rows: dict[int, Any] = {}
        self.asked += total
        try:
            if self.store is None and self.workers is None:
                self._run_here(listed, rows, report)
            else:
                self._run_kept(listed, rows, report)
        except (KeyboardInterrupt, SimulationInterrupted):
            self.interrupted = True
        for place, row in rows.items():
            found[places[place]] = row
        self.finished += failed + len(rows)
        return Rows(found)

    def _run_here(
        self, listed: CaseList, rows: dict[int, Any], report: Callable[[int], None]
    ) -> None:
        """Run cases on threads; their rows are kept in memory alone, as they are."""
        if self.interrupted or not listed.cases:
            return
        keep = "trace" if listed.record else "summary"
        for place, result in iterate_batch(listed.cases, threads=self.threads, keep=keep):
            rows[place] = (
                result
                if isinstance(result, Exception)
                else listed.measures[place].measured(listed.cases[place], result)
            )
            report(len(rows))

    def _run_kept(
        self, listed: CaseList, rows: dict[int, Any], report: Callable[[int], None]
    ) -> None:
        """Take known rows from the store, and run the other cases."""
        kept = _Kept(listed, cast("RowStore | None", self.store), rows)
        kept.take_known()
        if rows:
            report(len(rows))
        if kept.missing and not self.interrupted:
            self.run(listed, kept.missing, kept, lambda: report(len(rows)))

    def run(
        self,
        work: SweepStudy | CaseList,
        indices: Collection[int],
        sink: Sink,
        tell: Callable[[], None],
        chunk: int | None = None,
    ) -> None:
        """Run cases, each kept as soon as it is finished.

        Args:
            work: makes the cases.
            indices: of the cases to run.
            sink: keeps what becomes of them.
            tell: called whenever some were kept.
            chunk: cases that a worker is given at a time; None: 4, or fewer so that all have some.

        Raises:
            KeyboardInterrupt, SimulationInterrupted: Ctrl-C; what was finished is kept.
        """
        if self.workers is None:
            outcomes = case_outcomes(work, indices, self.threads)
            try:
                for outcome in outcomes:
                    sink.add([outcome])
                    tell()
            finally:
                outcomes.close()
            return
        from hexapod_pin.study.runs.distribution import Distribution

        size = chunk or max(1, min(CHUNK, len(indices) // self.workers.slots))
        cases = Distribution(
            work, sink, self.workers, chunk=size, threads=self.threads, progress=tell
        )
        try:
            cases.run(indices)
        except KeyboardInterrupt:
            cases.keep_finished()
            raise


class _Kept:
    """The rows of one list of cases: those that a store holds, and those that are being run."""

    def __init__(self, listed: CaseList, store: RowStore | None, rows: dict[int, Any]) -> None:
        self.listed, self.store, self.rows = listed, store, rows
        self.places: dict[str, list[int]] = {}
        for place, key in enumerate(listed.keys):
            self.places.setdefault(key, []).append(place)

    @property
    def path(self) -> Path | None:
        """The file of the store."""
        return None if self.store is None else self.store.path

    @property
    def finished(self) -> Collection[Any]:
        """The cases whose rows are known."""
        return self.rows

    @property
    def missing(self) -> list[int]:
        """The cases that are to be run; of cases that are the same, the first."""
        return [places[0] for places in self.places.values() if places[0] not in self.rows]

    def take_known(self) -> None:
        """Take the rows that the store holds."""
        if self.store is not None:
            for key in self.places.keys() & self.store.finished.keys():
                self._take(self.store.get(key))

    def add(self, outcomes: Iterable[Outcome]) -> None:
        """Keep what became of cases.

        Raises:
            WorkersError: a worker ran other cases.
        """
        given = list(outcomes)
        good = [one for one in given if one.verdict != NO_ROW]
        for one in given:
            if one.digest != self.listed.keys[one.index]:
                raise WorkersError("a worker returned the row of another case", len(self.rows))
        if self.store is not None:
            self.store.add(good)
        for one in good:
            self._take(one)
        for one in given:
            if one.verdict == NO_ROW:
                raise self.listed.row(one.index, one)

    def _take(self, outcome: Outcome) -> None:
        for place in self.places[outcome.digest]:
            self.rows[place] = self.listed.row(place, outcome)


# A study is begun: its options are checked, its store and its workers opened.


@checked
def run_study(
    study: Callable[..., Result],
    *args: Any,
    store: str | Path | None = None,
    resume: bool = False,
    retry_failed: bool = False,
    threads: int | None = None,
    processes: int | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Result:
    """Run a study, and return what it returns.

    Args:
        study: takes a `Runner`, then `args` and `settings`. For the same arguments it must request
            the same cases: then a study that was killed can be resumed.
        *args: of the study.
        store: see `RunOptions`, also for the options below.
        resume: continue a store.
        retry_failed: continue, and run failed cases again.
        threads: of the native core.
        processes: worker processes of this machine.
        executor: of `concurrent.futures`.
        scheduler: address of a Dask scheduler.
        progress: called with the finished fraction (0..1).
        **settings: of the study.

    Raises:
        ParameterError: an option is out of range, two ways of running were given, or a controller
            that cannot be written as data, with a store or workers.
        StoreExistsError: the store exists, and `resume` is not set.
        StoreLockedError, OtherStudyError, StoreFullError, SweepStoreError: the store cannot be
            used; all that was finished is kept.
        WorkersError: workers are gone or cannot run the cases; all that was finished is kept.
        StudyInterrupted: Ctrl-C; `.result` holds what the study makes of what was done.
        UserCodeError: `progress` has raised.

    Example:
        >>> run_study(my_study, scene, store="rows.db", resume=True, processes=4)
    """
    begin = None
    if store is not None:
        from hexapod_pin.study.runs.store import RowStore

        begin = partial(RowStore, store, resume=resume or retry_failed, retry=retry_failed)
    elif resume or retry_failed:
        name = "resume" if resume else "retry_failed"
        raise ParameterError(name, True, "left out without a store")
    try:
        with open_runner(
            begin, threads=threads, processes=processes, executor=executor, scheduler=scheduler,
            progress=user_callback("progress", progress),
        ) as run:  # fmt: skip
            return _finished(run, study, args, settings)
    except KeyboardInterrupt:
        raise StudyInterrupted("interrupted before any case was run", None) from None


def _finished(
    run: Runner, study: Callable[..., Result], args: tuple[Any, ...], settings: dict[str, Any]
) -> Result:
    """Return what a study returns.

    Raises:
        StudyInterrupted: Ctrl-C.
    """
    result, text = None, ""
    try:
        result = study(run, *args, **settings)
    except StudyInterrupted as error:
        result, text, run.interrupted = error.result, str(error), True
    except KeyboardInterrupt:
        run.interrupted = True
    if run.interrupted:
        text = text or f"interrupted after {run.finished} of {run.asked} cases"
        if run.store is not None:
            text += f"; they are kept in {run.store.path}, continue with --resume (resume=True)"
        raise StudyInterrupted(text, result)
    return cast("Result", result)


@contextmanager
def open_runner(
    begin: Callable[[], Store] | None,
    *,
    threads: int | None,
    processes: int | None,
    executor: Executor | Callable[[], Executor] | None,
    scheduler: str | None,
    progress: Progress | None,
) -> Iterator[Runner]:
    """Give a runner, with its store and its workers open; `begin` opens the store.

    Raises:
        ParameterError: an option is out of range, or two ways of running were given.
    """
    if threads is not None:
        check_threads(threads)
    check_count("processes", processes, MOST_PROCESSES)
    elsewhere = {"processes": processes, "executor": executor, "scheduler": scheduler}
    given = [name for name, value in elsewhere.items() if value is not None]
    if len(given) > 1:
        raise ParameterError(" and ".join(given), "both", "one of them")
    if scheduler is not None and not scheduler.strip():
        allowed = "the address of a Dask scheduler, such as 'tcp://10.0.0.1:8786'"
        raise ParameterError("scheduler", scheduler, allowed, "Leave it out to run here.")
    with ExitStack() as stack:
        workers = None
        if given:
            from hexapod_pin.study.runs.workers import workers_of

            workers = workers_of(processes, executor, scheduler)
            stack.callback(workers.close)
        store = None if begin is None else stack.enter_context(begin())
        yield Runner(store=store, workers=workers, threads=threads, progress=progress)


def check_count(name: str, value: int | None, most: int) -> None:
    """Refuse what is no count from 1 to `most`; None will do.

    Raises:
        ParameterError: names the value.
    """
    whole = isinstance(value, int) and not isinstance(value, bool)
    if value is not None and not (whole and 1 <= value <= most):
        raise ParameterError(name, value, f"a whole number from 1 to {most}")
