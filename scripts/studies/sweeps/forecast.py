"""What a sweep costs on many cores, from what one case and one message cost."""

from __future__ import annotations

import math
from dataclasses import dataclass

MESSAGES = 6
"""Messages that a task takes in Dask: client to scheduler (graph), scheduler to worker (compute),
worker to scheduler (finished), scheduler to client (in memory), client to scheduler (gather, which
fetches the result) and release; heartbeats and batching aside (`distributed`, "Journey of a
Task")."""


@dataclass(frozen=True)
class SweepCosts:
    """What was measured; times are processor time [s], sizes are bytes.

    Attributes:
        case: time of a case on a core.
        worker_memory: resident memory of a worker process.
        task_bytes: a task's message, with one case in it.
        task_case_bytes: of each further case.
        result_bytes: a case's result in its message.
        store_bytes: a case in the store.
        scheduler_task: time of the scheduler for a task.
        scheduler_case: time of the scheduler for each case of a task: its result passes through.
        parent_task: time of the parent for a task: sending, receiving, committing.
        parent_case: time of the parent for each case of a task: reading and inserting.
        parent_memory: resident memory of the parent before it reads a store.
        dataset_memory: of the parent for each case when the dataset is built.
    """

    case: float
    worker_memory: float
    task_bytes: float
    task_case_bytes: float
    result_bytes: float
    store_bytes: float
    scheduler_task: float
    scheduler_case: float
    parent_task: float
    parent_case: float
    parent_memory: float
    dataset_memory: float

    def parent_time(self, chunk: int) -> float:
        """Return the parent's time for a task [s]."""
        return self.parent_task + chunk * self.parent_case

    def scheduler_time(self, chunk: int) -> float:
        """Return the scheduler's time for a task [s]."""
        return self.scheduler_task + chunk * self.scheduler_case

    def cores_fed(self, chunk: int) -> tuple[float, str]:
        """Return how many cores are kept busy with tasks of so many cases, and what allows no more.

        A core asks for a task every `chunk * case`; parent and scheduler serve one at a time. A
        server whose time is below the tick of the clock that measured it, 0, is no limit (inf).
        """
        task = chunk * self.case
        times = {"parent": self.parent_time(chunk), "scheduler": self.scheduler_time(chunk)}
        return min((task / time if time > 0.0 else math.inf, who) for who, time in times.items())

    def dataset_cases(self, memory: float) -> float:
        """Return how many cases a dataset can have that is built within a memory [bytes]."""
        return max(0.0, memory - self.parent_memory) / self.dataset_memory


@dataclass(frozen=True)
class Forecast:
    """What a sweep costs on some cores.

    Attributes:
        cases: of the sweep.
        cores: that work.
        chunk: cases of a task.
        limit: "cores", "parent" or "scheduler": what allows no more cases per second.
        seconds: wall time [s].
        scheduler_load: share of its core that is busy, 0..1.
        parent_load: the same of the parent.
        messages: of the scheduler, per second.
        traffic: bytes of results per second.
    """

    cases: int
    cores: int
    chunk: int
    limit: str
    seconds: float
    scheduler_load: float
    parent_load: float
    messages: float
    traffic: float

    @property
    def hours(self) -> float:
        """Wall time [h]."""
        return self.seconds / 3600.0

    @property
    def rate(self) -> float:
        """Cases per second."""
        return self.cases / self.seconds

    @property
    def core_hours(self) -> float:
        """Time that the cores are held, idle or not [h]."""
        return self.hours * self.cores


def forecast(costs: SweepCosts, cases: int, cores: int, chunk: int) -> Forecast:
    """Return what a sweep costs; cores wait where parent or scheduler cannot feed them.

    Either the cores are always busy, for `cases * case / cores`; or the first results come after
    `chunk * case`, and then parent or scheduler are always busy.
    """
    task, count = chunk * costs.case, cases / chunk
    times = {
        "cores": max(task, cases * costs.case / cores),
        "parent": task + count * costs.parent_time(chunk),
        "scheduler": task + count * costs.scheduler_time(chunk),
    }
    limit = "cores" if cores <= costs.cores_fed(chunk)[0] else costs.cores_fed(chunk)[1]
    seconds = times[limit]
    return Forecast(
        cases, cores, chunk, limit, seconds, count * costs.scheduler_time(chunk) / seconds,
        count * costs.parent_time(chunk) / seconds, MESSAGES * count / seconds,
        cases * costs.result_bytes / seconds,
    )  # fmt: skip


def line(chunks: tuple[int, int], times: tuple[float, float]) -> tuple[float, float]:
    """Return a and b of times a + b chunk that were measured at two chunks; none is negative."""
    (small, large), (first, second) = chunks, times
    slope = max(0.0, (second - first) / (large - small))
    return max(0.0, first - slope * small), slope
