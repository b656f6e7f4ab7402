"""kill -9 of a sweep and of its workers at random moments: does the dataset keep its bits?"""

from __future__ import annotations

import multiprocessing
import os
import random
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hexapod_pin.errors import SweepStoreError
from hexapod_pin.study.runs import open_sweep, run_sweep
from hexapod_pin.study.runs.distribution import Distribution
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.workers import WorkerProcesses
from hexapod_pin.study.sweep import SweepStudy
from hexapod_pin.text_table import Table
from studies.study import StudyReport, verdict
from studies.sweeps.loopback_cluster import loopback_cluster

if TYPE_CHECKING:
    from xarray import Dataset

TEXT = """
schema = 1
name = "sweep that is killed"

[base]
robot = "kharagpur"
gait = {{ name = "tripod", stroke = 0.04, cycle_time = 0.3 }}
duration = {duration}
accuracy = 1e-4

[[vary]]
input = "mu"
distribution = "uniform"
low = 0.4
high = 0.9

[[vary]]
input = "payload"
distribution = "uniform"
low = 0.0
high = 1.0

[design]
kind = "random"
samples = {cases}
seed = {seed}
"""


@dataclass
class Tally:
    """What the kills of one kind came to."""

    kills: int = 0
    sweeps: int = 0
    same: int = 0
    lost: int = 0
    failed: int = 0

    def judge(self, found: Dataset, wanted: Dataset) -> None:
        """Compare the dataset of a finished sweep."""
        self.sweeps += 1
        self.same += same_bits(found, wanted)
        self.failed += int((found["reason"].values != "").sum())

    def row(self, name: str) -> list[str]:
        """Return the row of a table."""
        numbers = (self.kills, self.sweeps, self.same, self.lost, self.failed)
        return [name, *map(str, numbers), verdict(self.good)]

    @property
    def good(self) -> bool:
        """Whether nothing was lost and every bit is the same."""
        return self.same == self.sweeps > 0 and not self.lost and not self.failed


def sweep_kills(
    *, kills: int = 100, cases: int = 150, duration: float = 1.5, seed: int = -1
) -> StudyReport:
    """Kill sweeps and workers, half of the kills each; -1: a seed drawn anew."""
    seed = random.SystemRandom().randrange(10**6) if seed < 0 else seed
    print(f"seed {seed}", file=sys.stderr, flush=True)
    rng = random.Random(seed)
    study = SweepStudy.from_toml(TEXT.format(duration=duration, cases=cases, seed=seed))
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        begin = time.perf_counter()
        wanted = run_sweep(study, folder / "whole.db", threads=2).dataset
        taken = time.perf_counter() - begin
        parents = kill_sweeps(study, folder, wanted, kills - kills // 2, taken, rng)
        workers = kill_workers(study, folder, wanted, kills // 2, taken, rng)
        with loopback_cluster(2) as address:
            dask = Tally()
            dask.judge(run_sweep(study, folder / "dask.db", scheduler=address).dataset, wanted)
    tallies = {
        "the sweep (two threads)": parents,
        "one of two worker processes": workers,
        "none: two workers of a Dask scheduler": dask,
    }
    heads = ["killed", "kills", "sweeps finished", "same bits", "finished cases lost",
             "failed cases", "result"]  # fmt: skip
    return StudyReport(
        "Sweeps that are killed",
        [
            f"A sweep of {cases} walks of {duration:g} s at accuracy 1e-4, {taken:.1f} s "
            f"undisturbed on two threads; kill -9 at random moments, seed {seed}. After a kill of "
            "the sweep it is resumed from its store; a killed worker is started again. Every "
            "finished dataset is compared with the undisturbed one: every bit, name and label.",
            Table("", heads, [tally.row(name) for name, tally in tallies.items()]),
        ],
    )


def same_bits(found: Dataset, wanted: Dataset) -> bool:
    """Tell whether two datasets are the same to the bit, NaNs included."""
    return bool(found.identical(wanted)) and all(
        found[name].values.tobytes() == wanted[name].values.tobytes()
        for name in wanted.variables
        if wanted[name].dtype.kind == "f"
    )


def kill_sweeps(
    study: SweepStudy, folder: Path, wanted: Dataset, kills: int, taken: float, rng: random.Random
) -> Tally:
    """Kill a sweep again and again, going on with its store each time."""
    tally = Tally()
    for path in _stores(folder, "parent"):
        kept = 0
        while tally.kills < kills:
            child = multiprocessing.get_context("fork").Process(target=_sweep, args=(study, path))
            child.start()
            child.join(rng.uniform(0.0, 0.6 * taken))
            if child.exitcode is not None:
                break
            child.kill()
            child.join()
            tally.kills += 1
            now = finished(path)
            tally.lost += max(0, kept - now)
            kept = now
        tally.judge(run_sweep(study, path, resume=True).dataset, wanted)
        if tally.kills >= kills:
            break
    return tally


def _stores(folder: Path, name: str) -> Iterator[Path]:
    """Yield paths of stores that do not exist."""
    number = 0
    while True:
        yield folder / f"{name}{number}.db"
        number += 1


def _sweep(study: SweepStudy, path: Path) -> None:
    run_sweep(study, path, threads=2, resume=True)


def finished(path: Path) -> int:
    """Return how many cases a store holds; 0 of one that was not begun."""
    try:
        found = open_sweep(path)
    except SweepStoreError as error:
        if "no such file" in str(error) or "nothing yet" in str(error):
            return 0
        raise
    return len(found) - len(found.pending)


def kill_workers(
    study: SweepStudy, folder: Path, wanted: Dataset, kills: int, taken: float, rng: random.Random
) -> Tally:
    """Kill one of two worker processes again and again while they work."""
    tally = Tally()
    for path in _stores(folder, "worker"):
        workers, end = WorkerProcesses(2), threading.Event()
        killer = threading.Thread(target=_kill, args=(workers, end, tally, kills, taken, rng))
        killer.start()
        try:
            with SweepStore(path, study) as store:
                cases: Any = Distribution(
                    study, store, workers, chunk=4, threads=1, progress=lambda: None
                )
                cases.run(range(len(study)))
        finally:
            end.set()
            killer.join()
            workers.close()
        tally.judge(open_sweep(path).dataset, wanted)
        if tally.kills >= kills:
            return tally
    return tally


def _kill(
    workers: WorkerProcesses,
    end: threading.Event,
    tally: Tally,
    kills: int,
    taken: float,
    rng: random.Random,
) -> None:
    """Kill workers at random moments until there were enough kills or the sweep has ended."""
    while tally.kills < kills and not end.wait(rng.uniform(0.0, taken)):
        process = rng.choice(workers.workers).process
        if process is not None and process.poll() is None:
            os.kill(process.pid, signal.SIGKILL)
            tally.kills += 1
