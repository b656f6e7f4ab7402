"""Workers of a Dask scheduler that sleep for the time of their cases and send real results."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import cycle
from pathlib import Path
from typing import Any

from hexapod_pin.study.runs.distribution import Distribution
from hexapod_pin.study.runs.outcome import Outcome, from_bytes, to_bytes
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.task import Task, task_of
from hexapod_pin.study.runs.workers import DaskWorkers
from hexapod_pin.study.sweep import SweepStudy
from studies.sweeps.loopback_cluster import cluster_processes


def simulated_task(
    path: str, seconds: float, text: str, folder: str, digest: str, versions: dict[str, str],
    indices: list[int], threads: int,
) -> bytes:  # fmt: skip
    """Return results like those of real cases after so many seconds; the rest is a `Task`."""
    begin = time.perf_counter()
    answer = to_bytes(like(one, k) for k, one in zip(indices, cycle(_real(path)), strict=False))
    time.sleep(max(0.0, seconds - (time.perf_counter() - begin)))
    return answer


@lru_cache(maxsize=2)
def _real(path: str) -> list[Outcome]:
    """Return real outcomes from a file that holds an answer."""
    return from_bytes(Path(path).read_bytes())


def like(one: Outcome, index: int) -> Outcome:
    """Return an outcome with another index, and with texts that no other case has."""
    counters = json.dumps({**json.loads(one.counters or "{}"), "simulated": index})
    return replace(one, index=index, digest=f"{index:064x}", counters=counters)


class TimedStore(SweepStore):
    """A store that knows how long its writer has waited for the disk [s]."""

    waited = 0.0

    def add(self, outcomes: Iterable[Outcome]) -> list[int]:
        """Keep outcomes."""
        begin, cpu = time.perf_counter(), time.thread_time()
        found = super().add(outcomes)
        self.waited += time.perf_counter() - begin - (time.thread_time() - cpu)
        return found


class SimulatedWorkers(DaskWorkers):
    """Workers of a scheduler whose tasks are simulated."""

    def __init__(self, address: str, path: Path, case_time: float) -> None:
        """Connect; `path` holds the answer of a real worker, `case_time` [s] is slept for a case.

        Raises:
            WorkersError: there is no scheduler, or it has no worker.
        """
        super().__init__(address)
        self.path, self.case_time = str(path), case_time

    def submit(self, task: Task) -> Any:
        """Run a task."""
        seconds = self.case_time * len(task.indices)
        return self.executor.submit(simulated_task, self.path, seconds, *task[:6])


@dataclass(frozen=True)
class SimulatedSweep:
    """What a sweep on simulated workers took.

    Attributes:
        cases: that were run.
        chunk: of a task.
        cores: that were simulated, one sleeping thread for each.
        wall: time from the first task to the last row [s].
        parent: processor time of its process and its wait for the disk [s].
        scheduler: processor time of its process [s].
    """

    cases: int
    chunk: int
    cores: int
    wall: float
    parent: float
    scheduler: float

    @property
    def tasks(self) -> int:
        """Number of tasks."""
        return -(-self.cases // self.chunk)

    @property
    def rate(self) -> float:
        """Cases per second."""
        return self.cases / self.wall


def simulated_sweep(
    study: SweepStudy, store: Path, real: Path, *, chunk: int, case_time: float,
    processes: int, threads: int,
) -> SimulatedSweep:  # fmt: skip
    """Run a sweep as `run_sweep` does, but on simulated workers.

    Args:
        study: its number of cases is run.
        store: of the results.
        real: file that holds the answer of a real worker.
        chunk: cases of a task.
        case_time: time that a case takes on a simulated core [s].
        processes: of the simulated workers.
        threads: of each process: the simulated cores.
    """
    import psutil  # a requirement of `distributed`

    with cluster_processes(processes, threads) as cluster:
        workers = SimulatedWorkers(cluster.address, real, case_time)
        try:
            kept = TimedStore(store, study)
            with kept:
                sweep = Distribution(
                    study, kept, workers, chunk=chunk, threads=1, progress=lambda: None
                )
                _warm_up(workers, study)
                times = psutil.Process(cluster.scheduler).cpu_times
                scheduler, parent, begin = times(), time.process_time(), time.perf_counter()
                sweep.run(range(len(study)))
                wall, parent = (
                    time.perf_counter() - begin,
                    time.process_time() - parent + kept.waited,
                )
                after = times()
        finally:
            workers.close()
    used = after.user + after.system - scheduler.user - scheduler.system
    return SimulatedSweep(len(study), chunk, processes * threads, wall, parent, used)


def _warm_up(workers: SimulatedWorkers, study: SweepStudy) -> None:
    """Let every process import what it needs, which is no part of a long sweep."""
    task = task_of(study, [0], 1)
    workers.client.run(_once, workers.path, task)
    for future in [workers.submit(task) for _ in range(2 * workers.slots)]:
        future.result()


def _once(path: str, task: Task) -> None:
    simulated_task(path, 0.0, *task[:6])
