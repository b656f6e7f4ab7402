"""The cases of a study run here or on workers, and each is stored when it is finished."""

from __future__ import annotations

import itertools
import queue
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError, SimulationInterrupted, SweepInterrupted, WorkersError
from hexapod_pin.simulation.batch import check_threads
from hexapod_pin.sweep.runs.outcome import Outcome, failure, from_bytes
from hexapod_pin.sweep.runs.store import SweepStore
from hexapod_pin.sweep.runs.sweep_result import SweepResult, open_sweep
from hexapod_pin.sweep.runs.task import REFUSAL, case_outcomes, task_of
from hexapod_pin.sweep.runs.workers import (
    DaskWorkers,
    PoolWorkers,
    WorkerDied,
    WorkerProcesses,
    Workers,
)
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.sweep.study import SweepStudy


THREADS = 2
"""Threads of the native core where cases run in this process."""

CHUNK = 4
"""Cases of a task for a worker: the most that the death of one worker loses."""

MOST_PROCESSES = 1024
"""Worker processes of one machine [-]."""

MOST_CHUNK = 100_000
"""Cases of one task [-]."""


@checked
def run_sweep(
    study: SweepStudy,
    store: str | Path = "study.db",
    *,
    threads: int | None = None,
    processes: int | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
    scheduler: str | None = None,
    chunk: int = CHUNK,
    resume: bool = False,
    retry_failed: bool = False,
    progress: Callable[[float], None] | None = None,
) -> SweepResult:
    """Run all cases of a study; each is on the disk as soon as it is finished.

    Cases run on threads of this process, unless one of `processes`, `executor` and `scheduler` is
    given. The results are the same to the bit. A case that fails is a row with its reason.

    Args:
        study: whose cases to run.
        store: the SQLite file that keeps them.
        threads: of the native core; None: 2 in this process, 1 in each worker.
        processes: worker processes of this machine.
        executor: of `concurrent.futures`, or a function that makes one (and, where it breaks,
            another). A broken `ProcessPoolExecutor` is made anew.
        scheduler: address of a Dask scheduler, such as "tcp://10.0.0.1:8786".
        chunk: cases that a worker is given at a time.
        resume: go on with a store that exists: what is finished is not run again.
        retry_failed: go on, and run failed cases again.
        progress: called with the finished fraction (0..1).

    Raises:
        ParameterError: an argument is out of range, or two ways of running were given.
        StoreExistsError: the store exists, and `resume` is not set.
        StoreLockedError, OtherStudyError, StoreFullError, SweepStoreError: the store cannot be
            used; all that was finished is kept.
        WorkersError: workers are gone or cannot run the study; all that was finished is kept.
        SweepInterrupted: Ctrl-C; `.result` holds what was done, all of it is kept.

    Example:
        >>> sweep = run_sweep(load_sweep("study.toml"), "study.db", resume=True)
        >>> sweep.save("study.nc")
    """
    _check(threads, processes, chunk)
    elsewhere = {"processes": processes, "executor": executor, "scheduler": scheduler}
    given = [name for name, value in elsewhere.items() if value is not None]
    if len(given) > 1:
        raise ParameterError(" and ".join(given), "both", "one of them")
    if scheduler is not None and not scheduler.strip():
        allowed = "the address of a Dask scheduler, such as 'tcp://10.0.0.1:8786'"
        raise ParameterError("scheduler", scheduler, allowed, "Leave it out to run here.")
    path, begun = user_path(store), False
    workers = _workers(processes, executor, scheduler)
    try:
        with SweepStore(path, study, resume=resume or retry_failed, retry=retry_failed) as kept:
            begun = True
            report = _Report(len(study), kept, progress)
            if workers is not None:
                _run_elsewhere(study, kept, workers, chunk, threads or 1, report)
            else:
                _run_here(study, kept, threads or THREADS, report)
    except (KeyboardInterrupt, SimulationInterrupted):
        if not begun:
            raise
        result = open_sweep(path)
        text = (
            f"interrupted: {len(result) - len(result.pending)} of {len(result)} cases are kept in "
            f"{path}; go on with --resume (resume=True)"
        )
        raise SweepInterrupted(text, result) from None
    finally:
        if workers is not None:
            workers.close()
    return open_sweep(path)


class _Report:
    """Tells how far a sweep is."""

    def __init__(
        self, total: int, store: SweepStore, progress: Callable[[float], None] | None
    ) -> None:
        self.total, self.store, self.progress = total, store, progress
        self()

    def __call__(self) -> None:
        if self.progress is not None:
            self.progress(len(self.store.finished) / self.total)


def _check(threads: int | None, processes: int | None, chunk: int) -> None:
    if threads is not None:
        check_threads(threads)
    for name, value, most in (
        ("processes", processes, MOST_PROCESSES), ("chunk", chunk, MOST_CHUNK)
    ):  # fmt: skip
        whole = isinstance(value, int) and not isinstance(value, bool)
        if value is not None and not (whole and 1 <= value <= most):
            raise ParameterError(name, value, f"a whole number from 1 to {most}")


def _run_here(study: SweepStudy, store: SweepStore, threads: int, report: _Report) -> None:
    """Run on threads of this process."""
    outcomes = case_outcomes(study, _open(study, store), threads)
    try:
        for outcome in outcomes:
            store.add([outcome])
            report()
    finally:
        outcomes.close()


def _run_elsewhere(
    study: SweepStudy, store: SweepStore, workers: Workers, chunk: int, threads: int,
    report: _Report,
) -> None:  # fmt: skip
    """Run on workers."""
    cases = Distribution(study, store, workers, chunk=chunk, threads=threads, progress=report)
    try:
        cases.run(_open(study, store))
    except KeyboardInterrupt:
        cases.keep_finished()
        raise


def _workers(
    processes: int | None,
    executor: Executor | Callable[[], Executor] | None,
    scheduler: str | None,
) -> Workers | None:
    """Return what runs cases elsewhere, checked before a store is begun; None: they run here."""
    if scheduler is not None:
        return DaskWorkers(scheduler)
    if executor is not None:
        return PoolWorkers(executor)
    return None if processes is None else WorkerProcesses(processes)


def _open(study: SweepStudy, store: SweepStore) -> list[int]:
    """Return the cases that are to be run."""
    return [index for index in range(len(study)) if index not in store.finished]


# Cases of a sweep on workers: handed out in pieces, kept when they come back, given out anew.

AHEAD = 2
"""Pieces under way for each worker."""

SUSPECT = 2
"""Broken pools after which a case that was in each of them is run alone."""

PATIENCE = 1.0
"""Longest wait between two looks at the workers [s]."""

TOGETHER = 64
"""Most pieces that are put on the disk at a time, where they come faster than it can take them."""


class Distribution:
    """Cases under way on workers.

    A piece whose worker died is given out again. Where one death breaks the whole pool, cases that
    were in it twice are run alone, so that those beside a case that kills its worker are not blamed
    for it. A case that ends its worker three times alone has failed.
    """

    def __init__(
        self,
        study: SweepStudy,
        store: SweepStore,
        workers: Workers,
        *,
        chunk: int,
        threads: int,
        progress: Callable[[], None],
    ) -> None:
        """Take what is to be run; nothing is handed out yet."""
        self.study, self.store, self.workers = study, store, workers
        self.chunk, self.threads, self.progress = chunk, threads, progress
        self.under_way: dict[Future[bytes], list[int]] = {}
        self.ended: queue.SimpleQueue[Future[bytes]] = queue.SimpleQueue()
        self.found: list[Outcome] = []  # come back, and kept at once
        self.again: deque[list[int]] = deque()
        self.alone: deque[int] = deque()
        self.company: Counter[int] = Counter()
        self.strikes: Counter[int] = Counter()
        self.deaths, self.answers = 0, 0
        self.blamed: list[Outcome] = []  # until a worker has shown that it can run anything
        self.broken = self.single = False

    def run(self, indices: Iterable[int]) -> None:
        """Run all cases.

        Raises:
            WorkersError: no worker is left, or they cannot run the study.
            StoreFullError, SweepStoreError: results cannot be kept.
        """
        pieces = self._pieces(iter(indices))
        while True:
            self._hand_out(pieces)
            if not self.under_way:
                if not self.broken:
                    self._keep()
                    return
                self.workers.renew()
                self.broken = False
                continue
            try:
                for future in self._next_ended():
                    self._take(self.under_way.pop(future), future)
            finally:
                self._keep_found()

    def _next_ended(self) -> Iterator[Future[bytes]]:
        """Wait for a piece and yield all that have ended by then; nothing if that takes long.

        The time is that of those that end, however many are under way.
        """
        for count in range(TOGETHER):
            try:
                future = self.ended.get(count == 0, PATIENCE)
            except queue.Empty:
                return
            if future in self.under_way:
                yield future

    def keep_finished(self) -> None:
        """Keep what has come back by now."""
        for future in [one for one in self.under_way if one.done() and not one.cancelled()]:
            if future.exception() is None:
                self._take(self.under_way.pop(future), future)
        self._keep_found()

    def _pieces(self, indices: Iterator[int]) -> Iterator[list[int]]:
        """Yield pieces of cases that were not given out yet."""
        while piece := list(itertools.islice(indices, self.chunk)):
            yield piece

    def _hand_out(self, pieces: Iterator[list[int]]) -> None:
        """Give tasks to the workers, as many as keep them busy; or one that runs alone."""
        self.single = bool(self.alone)
        if self.alone:
            if not self.under_way and not self.broken:
                self._submit([self.alone.popleft()])
            return
        while not self.broken and len(self.under_way) < AHEAD * self.workers.slots:
            piece = self.again.popleft() if self.again else next(pieces, None)
            if piece is None:
                return
            self._submit(piece)

    def _submit(self, piece: list[int]) -> None:
        try:
            future = self.workers.submit(task_of(self.study, piece, self.threads))
        except BrokenExecutor:
            self.again.appendleft(piece)
            self.broken = True
            return
        self.under_way[future] = piece
        future.add_done_callback(self.ended.put)

    def _take(self, piece: list[int], future: Future[bytes]) -> None:
        """Keep what a task has come to, or give it out again."""
        try:
            answer = future.result()
        except (BrokenExecutor, WorkerDied) as error:
            return self._died(piece, failure(error))
        except CancelledError as error:
            raise self._lost("the scheduler dropped its tasks: it has gone") from error
        except Exception as error:
            if type(error).__name__ == "KilledWorker":  # Dask's
                return self._died(piece, failure(error))
            raise self._lost(f"a worker failed: {failure(error)}") from error
        if answer.startswith(REFUSAL):
            raise self._lost(f"a worker cannot run the study: {answer[1:].decode()}")
        self.answers += 1
        self.found += from_bytes(answer)

    def _died(self, piece: list[int], why: str) -> None:
        """Give the cases of a dead worker out again, or find that one of them is to blame."""
        isolates = self.workers.isolates
        self.broken = self.broken or not isolates
        self.deaths += 1
        if not self.answers and self.deaths > 8 + 4 * AHEAD * self.workers.slots:
            raise self._lost(f"workers end before they answer anything ({why})")
        if len(piece) == 1 and (isolates or self.single):
            self._strike(piece[0], why)
        elif isolates:
            self.again.extend([index] for index in piece)
        else:
            self.company.update(piece)
            self.alone.extend(index for index in piece if self.company[index] >= SUSPECT)
            rest = [index for index in piece if self.company[index] < SUSPECT]
            self.again.extend([rest] if rest else [])

    def _strike(self, index: int, why: str) -> None:
        """Count a death against a case that ran alone."""
        self.strikes[index] += 1
        if self.strikes[index] < self.workers.strikes:
            if self.workers.isolates:
                self.again.append([index])
            else:
                self.alone.append(index)
            return
        times = f"{self.strikes[index]} times" if self.workers.strikes > 1 else "again and again"
        reason = f"WorkerDied: this case ended its worker {times} ({why})"
        try:
            digest = self.study.case(index).digest
        except Exception:
            digest = ""
        self.blamed.append(Outcome(index, digest, reason))
        if self.answers:
            self._keep()

    def _keep_found(self) -> None:
        """Keep what has come back, and with it cases that are to blame."""
        if self.found:
            self._keep()

    def _keep(self) -> None:
        """Keep what has come back, and cases that are to blame for the death of their workers."""
        if self.found or self.blamed:
            self.store.add([*self.found, *self.blamed])
            self.found, self.blamed = [], []
            self.progress()

    def _lost(self, what: str) -> WorkersError:
        kept = len(self.store.finished)
        have = f"{kept} finished cases are kept in {self.store.path}; go on with --resume " \
               "(resume=True)" if kept else "No case was finished"  # fmt: skip
        return WorkersError(f"{what}. {have}.", kept)
