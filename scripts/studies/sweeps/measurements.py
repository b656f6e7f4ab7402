"""What workers, parent, scheduler and store of a sweep take: measured here."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from hexapod_pin.study.runs.outcome import from_bytes
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.task import run_task, task_of
from hexapod_pin.study.runs.workers import WorkerProcess
from hexapod_pin.study.sweep import SweepStudy
from studies.sweeps.forecast import SweepCosts, line
from studies.sweeps.many_walks import STROKES, many_walks
from studies.sweeps.simulated_workers import SimulatedSweep, like, simulated_sweep

CHUNKS = (4, 64)
"""Cases of a task at which parent and scheduler are measured."""

THREADS = 64
"""Simulated cores of a worker process."""

READ = """
import sys
from pathlib import Path
from hexapod_pin.study.runs import open_sweep
import numpy, xarray
def size():
    (line,) = [x for x in Path("/proc/self/status").read_text().splitlines() if "VmHWM" in x]
    return 1024 * int(line.split()[1])
before = size()
found = open_sweep(sys.argv[1])
opened = size()
found.dataset
print(before, opened, size())
"""
"""Largest resident memory of a process that opens a store and builds its dataset, on Linux."""


class WorkerCost(NamedTuple):
    """What a worker process takes."""

    case: float  # processor time of a case [s]
    memory: float  # resident [bytes]
    answer: bytes


class ReadMemory(NamedTuple):
    """Peak memory of a process that reads a store [bytes]."""

    before: float
    opened: float
    dataset: float


@dataclass(frozen=True)
class Measured:
    """All that was measured; `rows` is by chunk, rows per second into the store."""

    costs: SweepCosts
    saturated: tuple[SimulatedSweep, ...]
    rows: dict[int, float]
    opened_memory: float  # for each case when a store is opened [bytes]


def measure(
    folder: Path, *, cases: int, duration: float, walks: int, seed: int, cores: int
) -> Measured:
    """Measure what a forecast needs.

    Args:
        folder: for stores and the answer of a real worker.
        cases: of each sweep on simulated workers.
        duration: of a walk [s].
        walks: that a worker really runs.
        seed: of the study.
        cores: that are simulated, by processes of at most `THREADS`.
    """
    worker = worker_cost(many_walks(walks, duration, seed))
    real = folder / "answer"
    real.write_bytes(worker.answer)
    study = many_walks(cases, duration, seed)
    found = []
    for chunk in CHUNKS:
        found.append(simulated_sweep(
            study, folder / f"saturated{chunk}.db", real, chunk=chunk,
            case_time=0.02 / chunk, processes=-(-cores // THREADS), threads=min(cores, THREADS),
        ))  # fmt: skip
    parent = line(CHUNKS, _each(found, "parent"))
    scheduler = line(CHUNKS, _each(found, "scheduler"))
    few = max(len(STROKES), cases // 4 // len(STROKES) * len(STROKES))
    rows = {chunk: store_rate(many_walks(few, duration, seed), folder, worker.answer, chunk)
            for chunk in CHUNKS}  # fmt: skip
    sizes = (few, cases)
    reads = [read_memory(path) for path in (folder / "rows4.db", folder / "saturated4.db")]
    task = task_bytes(study, 1)
    costs = SweepCosts(
        case=worker.case,
        worker_memory=worker.memory,
        task_bytes=task,
        task_case_bytes=(task_bytes(study, 101) - task) / 100,
        result_bytes=len(worker.answer) / walks,
        store_bytes=(folder / "saturated4.db").stat().st_size / cases,
        scheduler_task=scheduler[0],
        scheduler_case=scheduler[1],
        parent_task=parent[0],
        parent_case=parent[1],
        parent_memory=reads[0].before,
        dataset_memory=_slope(sizes, [read.dataset for read in reads]),
    )
    opened = _slope(sizes, [read.opened for read in reads])
    return Measured(costs, tuple(found), rows, opened)


def _each(found: Sequence[SimulatedSweep], name: str) -> tuple[float, float]:
    first, second = (getattr(one, name) / one.tasks for one in found)
    return first, second


def _slope(sizes: tuple[int, int], values: Sequence[float]) -> float:
    """Return the growth with the number of cases; at least a byte, where it drowns in noise."""
    return max(1.0, (values[1] - values[0]) / max(1, sizes[1] - sizes[0]))


def worker_cost(study: SweepStudy) -> WorkerCost:
    """Run all cases of a study in one worker process, after one round that plans its gaits.

    Processor time is counted in ticks; where all cases end within one, it is that tick.
    """
    import psutil

    worker = WorkerProcess()
    try:
        worker.run(task_of(study, [k * study.rows for k in range(study.grid_points)], 1))
        assert worker.process is not None
        process = psutil.Process(worker.process.pid)
        before = process.cpu_times()
        answer = worker.run(task_of(study, list(range(len(study))), 1))
        after = process.cpu_times()
        used = after.user + after.system - before.user - before.system
        used = max(used, 1.0 / os.sysconf("SC_CLK_TCK"))
        return WorkerCost(used / len(study), process.memory_info().rss, answer)
    finally:
        worker.kill()
        worker.let_go()


def task_bytes(study: SweepStudy, cases: int) -> int:
    """Return the size of a task's function and arguments as Dask pickles them [bytes]."""
    from distributed.protocol import pickle

    dumps: Any = pickle.dumps
    return len(dumps((run_task, task_of(study, list(range(10**6, 10**6 + cases)), 1))))


def store_rate(study: SweepStudy, folder: Path, answer: bytes, chunk: int) -> float:
    """Return how many cases per second are read from answers and put on the disk."""
    real = from_bytes(answer)
    rows = [like(real[k % len(real)], k) for k in range(len(study))]
    rows = [replace(one, wall_time=0.1) for one in rows]
    with SweepStore(folder / f"rows{chunk}.db", study) as store:
        begin = time.perf_counter()
        for start in range(0, len(rows), chunk):
            store.add(rows[start : start + chunk])
        return len(rows) / (time.perf_counter() - begin)


def read_memory(store: Path) -> ReadMemory:
    """Open a store and build its dataset in a process of its own."""
    text = subprocess.run(
        [sys.executable, "-c", READ, str(store)], check=True, capture_output=True, text=True
    ).stdout
    return ReadMemory(*map(float, text.split()))
