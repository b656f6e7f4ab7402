"""Ten thousand walks on two cores: time, memory, size; beside MuJoCo at the same trunk error."""

from __future__ import annotations

import random
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.study.runs import SweepResult, run_sweep
from hexapod_pin.study.sweep import SweepStudy
from hexapod_pin.text_table import Table
from studies.kills.sweep_kills import same_bits
from studies.study import StudyReport, verdict
from studies.sweeps.batch import peak_memory
from studies.sweeps.loopback_cluster import loopback_cluster
from studies.sweeps.many_walks import TimeSplit, many_walks, time_split
from studies.sweeps.mujoco_table import mujoco_parts

if TYPE_CHECKING:
    from xarray import Dataset

MOST_TIME = 360.0
"""Of ten thousand cases [s]; of fewer, their share."""

MOST_MEMORY = 1000.0
"""Of the process, at its largest [MB]."""

FULL = 10_000
"""Cases that the targets are for."""

SPLIT_CASES = 24
"""Cases whose time is split."""


@dataclass(frozen=True)
class SweepRun:
    """What a sweep took: times of the sweep and of its netCDF file [s], sizes [bytes]."""

    result: SweepResult
    dataset: Dataset
    wall: float
    cpu: float
    store_size: int
    file_time: float
    file_size: int


def sweep_cost(
    *,
    cases: int = FULL,
    duration: float = 5.0,
    dask: int = 200,
    samples: int = 2,
    fine: float = 2e-5,
    rounds: int = 3,
    seed: int = -1,
) -> StudyReport:
    """Sweep many walks on two threads, some on a Dask cluster, and a few by MuJoCo.

    Args:
        cases: of the sweep, a multiple of four.
        duration: of each walk [s]; 0: until a cycle repeats, which MuJoCo is not run to.
        dask: cases of which a cluster of two workers must give the same dataset; 0: none.
        samples: random cases that MuJoCo runs too; 0: none.
        fine: step of MuJoCo's reference [s].
        rounds: timed runs of these, of which the median is taken.
        seed: of the samples; -1: drawn anew.
    """
    seed = random.SystemRandom().randrange(10**6) if seed < 0 else seed
    print(f"seed {seed}", file=sys.stderr, flush=True)
    study = many_walks(cases, duration, seed)
    before = peak_memory()
    with tempfile.TemporaryDirectory() as place:
        run = _sweep(study, Path(place))
        memory = peak_memory()
        same = _same_on_cluster(dask, duration, seed, Path(place))
    rng = random.Random(seed)
    split = time_split(study, sorted(rng.sample(range(cases), min(SPLIT_CASES, cases))))
    length = f"{duration:g} s each" if duration else "each until a cycle repeats,"
    rows = [*_target_rows(run, memory, same), *_rows(run, before)]
    parts: list[str | Table] = [
        f"{cases} tripod walks of kharagpur, {length} with a cycle of 1 s, at accuracy "
        f"1e-4, on two threads: strokes of 60, 80, 100 and 120 mm, each with {cases // 4} samples "
        "of a latin hypercube: friction uniform from 0.4 to 0.9, contact stiffness lognormal by a "
        f"factor of 1.5, servo stiffness by 1.2; seed {seed}. Every case is on the disk as soon as "
        "it is finished. The time includes the inputs written at the start and the store read at "
        f"the end. Targets are those of {FULL} cases in {MOST_TIME:g} s, scaled by their number.",
        Table("", ["", "measured", "target", "result"], rows),
        Table(f"Processor time of a case, alone on one thread ({SPLIT_CASES} cases at most)",
              ["part", "ms", "share"], _split_rows(split)),
    ]  # fmt: skip
    if samples and duration:
        chosen = rng.sample(range(cases), min(samples, cases))
        parts += mujoco_parts(study, chosen, fine, rounds, FULL, run.wall / cases)
    return StudyReport("The cost of a sweep", parts)


def _sweep(study: SweepStudy, folder: Path) -> SweepRun:
    begin, cpu = time.perf_counter(), time.process_time()
    result = run_sweep(study, folder / "walks.db", threads=2)
    wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
    begin = time.perf_counter()
    path = result.save(folder / "walks.nc")
    taken = time.perf_counter() - begin
    size = (folder / "walks.db").stat().st_size
    return SweepRun(result, result.dataset, wall, cpu, size, taken, path.stat().st_size)


def _same_on_cluster(cases: int, duration: float, seed: int, folder: Path) -> bool | None:
    """Tell whether two threads and two workers of a Dask scheduler give the same bits."""
    if not cases:
        return None
    study = many_walks(cases, duration, seed)
    here = run_sweep(study, folder / "here.db", threads=2).dataset
    with loopback_cluster(2) as address:
        there = run_sweep(study, folder / "dask.db", scheduler=address).dataset
    return same_bits(there, here)


def _target_rows(run: SweepRun, memory: float, same: bool | None) -> list[list[str]]:
    """Return the rows that must be met, with `pass` or `FAIL`."""
    count, failed = len(run.result), len(run.result.failed)
    most = MOST_TIME * count / FULL
    rows = [
        ["wall time", f"{run.wall:.1f} s", f"below {most:g} s", verdict(run.wall < most)],
        ["largest memory of the process (RSS), dataset and netCDF included", f"{memory:.0f} MB",
         f"below {MOST_MEMORY:g} MB", verdict(memory < MOST_MEMORY)],
        ["cases with numbers or a reason", str(run.result.done + failed), str(count),
         verdict(run.result.done + failed == count)],
    ]  # fmt: skip
    if same is not None:
        text = "the same" if same else "others"
        rows.append(["bits on two workers of a Dask scheduler", text, "the same", verdict(same)])
    return rows


def _rows(run: SweepRun, before: float) -> list[list[str]]:
    count, data = len(run.result), run.dataset
    reasons = ", ".join(f"{k}: {n}" for k, n in run.result.reasons.items()) or "none"
    steps, evaluations = (_mean(data, name) for name in ("count_steps", "count_evaluations"))
    rows = [
        ["failed cases", f"{len(run.result.failed)} ({reasons})"],
        ["cases that do not walk as planned", str(run.result.not_walking)],
        ["memory before the sweep", f"{before:.0f} MB"],
        ["wall time of a case", f"{1e3 * run.wall / count:.1f} ms"],
        ["processor time", f"{run.cpu:.1f} s, {1e3 * run.cpu / count:.1f} ms a case"],
        ["of two cores busy", f"{run.cpu / (2 * run.wall):.0%}"],
        ["steps of a case, evaluations", f"{steps:.0f}, {evaluations:.0f}"],
        ["store", f"{run.store_size / 1e6:.1f} MB, {run.store_size / count:.0f} bytes a case"],
        ["netCDF", f"{run.file_size / 1e6:.1f} MB, written in {run.file_time:.1f} s"],
    ]
    return [[*row, "", ""] for row in rows]


def _mean(data: Dataset, name: str) -> float:
    """Return the mean of a counter over the cases that have it."""
    if name not in data:
        return float("nan")
    values = data[name].values
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else float("nan")


def _split_rows(split: TimeSplit) -> Sequence[Sequence[str]]:
    parts = {
        "integration in the core": split.core,
        "case made from its inputs": split.case,
        "planning and set-up": split.plan,
        "summary, verdict, digest, bytes": split.result,
        "all": split.total,
    }
    return [[k, f"{1e3 * value:.2f}", f"{value / split.total:.0%}"] for k, value in parts.items()]
