"""Cases are given to workers in pieces, stored when they return, and given again after a death."""

from __future__ import annotations

import itertools
import queue
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from hexapod_pin.errors import WorkersError
from hexapod_pin.study.runs.measure import pack_error
from hexapod_pin.study.runs.outcome import Outcome, failure, from_bytes
from hexapod_pin.study.runs.task import REFUSAL, CaseList, task_of
from hexapod_pin.study.runs.workers import WorkerDied, Workers

if TYPE_CHECKING:
    from hexapod_pin.study.sweep import SweepStudy

AHEAD = 2
"""Pieces under way for each worker."""

SUSPECT = 2
"""Broken pools after which a case that was in each of them is run alone."""

PATIENCE = 1.0
"""Longest wait between two looks at the workers [s]."""

TOGETHER = 64
"""Most pieces that are put on the disk at a time, where they come faster than it can take them."""


class Sink(Protocol):
    """Stores outcomes of cases, such as a store."""

    @property
    def path(self) -> Path | None:
        """Its file; None where it has none."""

    @property
    def finished(self) -> Collection[Any]:
        """The cases that it holds."""

    def add(self, outcomes: Iterable[Outcome]) -> Any:
        """Keep outcomes."""


class Distribution:
    """Cases under way on workers.

    A piece whose worker died is given out again. Where one death breaks the whole pool, cases that
    were in it twice are run alone, so that those beside a case that kills its worker are not blamed
    for it. A case that ends its worker three times alone has failed.
    """

    def __init__(
        self,
        work: SweepStudy | CaseList,
        store: Sink,
        workers: Workers,
        *,
        chunk: int,
        threads: int,
        progress: Callable[[], None],
    ) -> None:
        """Take the cases, and where their outcomes go; nothing is given to workers yet."""
        self.work, self.store, self.workers = work, store, workers
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
            future = self.workers.submit(task_of(self.work, piece, self.threads))
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
        self.blamed.append(_blamed(self.work, index, reason))
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
        have = "No case was finished"
        if kept and self.store.path is not None:
            have = (
                f"{kept} finished cases are kept in {self.store.path}; continue with --resume "
                "(resume=True)"
            )
        elif kept:
            have = f"{kept} cases were finished, but not kept: there is no store"
        return WorkersError(f"{what.rstrip('.')}. {have}.", kept)


def _blamed(work: SweepStudy | CaseList, index: int, reason: str) -> Outcome:
    """Return what became of a case that ends its workers."""
    if isinstance(work, CaseList):
        error = WorkersError(reason.partition(": ")[2], 0)
        return Outcome(index, work.keys[index], reason, counters=pack_error(error))
    try:
        digest = work.case(index).digest
    except Exception:
        digest = ""
    return Outcome(index, digest, reason)
