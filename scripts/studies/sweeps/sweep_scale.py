"""What a million walks cost on a hundred and a thousand cores, and what saturates first."""

from __future__ import annotations

import random
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.validation.machine import Machine
from studies.study import RESULTS, StudyReport
from studies.sweeps.forecast import SweepCosts, forecast
from studies.sweeps.many_walks import many_walks
from studies.sweeps.measurements import Measured, measure
from studies.sweeps.scale_page import (
    check_table,
    cost_table,
    fed_table,
    forecast_table,
    scale_page,
)
from studies.sweeps.simulated_workers import SimulatedSweep, simulated_sweep

CORES = (2, 100, 1000)
CHUNKS = (4, 32, 256)

CHECKS = ((16, 4, 2), (100, 16, 4), (1000, 16, 8))
"""Simulated cores, cases of a task and worker processes of the sweeps that check the forecast."""

ROUNDS = 8
"""Tasks of each simulated core in a check; fewer where the number of cases is limited."""


def sweep_scale(
    *,
    cases: int = 1_000_000,
    simulated: int = 12_000,
    walks: int = 80,
    duration: float = 5.0,
    seed: int = -1,
    memory: float = 8.0,
    most: int = 1000,
    saturating: int = 128,
    page: Path = RESULTS / "scale.md",
) -> StudyReport:
    """Measure what a case, a task and a row cost; forecast a large sweep; check it.

    Args:
        cases: of the large sweep.
        simulated: cases of each sweep on simulated workers, a multiple of four.
        walks: that a worker really runs, a multiple of four.
        duration: of a walk [s].
        seed: of the samples; -1: drawn anew.
        memory: within which the dataset is to be built [GB].
        most: cores that are simulated in a check.
        saturating: simulated cores that keep parent and scheduler busy while these are measured.
        page: where the page for readers goes.
    """
    seed = random.SystemRandom().randrange(10**6) if seed < 0 else seed
    print(f"seed {seed}", file=sys.stderr, flush=True)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        found = measure(folder, cases=simulated, duration=duration, walks=walks, seed=seed,
                        cores=saturating)  # fmt: skip
        checks = [
            (run, found.costs)
            for cores, chunk, processes in CHECKS
            if cores <= most
            for run in [_check(folder, found.costs, cores, chunk, processes, simulated, duration)]
        ]
    tables = [
        cost_table(found, walks),
        fed_table(found.costs),
        forecast_table([forecast(found.costs, cases, n, c) for n in CORES for c in CHUNKS],
                       found.costs),
        check_table(checks),
    ]  # fmt: skip
    text = scale_page(found, checks, tables, cases, memory, duration, str(Machine.here()))
    write_atomically(page, text)
    intro = (
        f"Walks of {duration:g} s as of the cost of a sweep, seed {seed}. Times are processor "
        "time, so other load matters little; where parent, scheduler and simulated workers share "
        "too few cores, measured rates of saturated sweeps lie below the forecast. The "
        f"page for readers is {page.name} in the documentation."
    )
    return StudyReport(
        "A million walks on many cores", [intro, *tables], _data(found, [run for run, _ in checks])
    )


def _check(
    folder: Path, costs: SweepCosts, cores: int, chunk: int, processes: int, most: int,
    duration: float,
) -> SimulatedSweep:  # fmt: skip
    """Run a sweep on so many simulated cores, each case taking its real time."""
    cases = max(4, min(cores * chunk * ROUNDS, most) // 4 * 4)
    return simulated_sweep(
        many_walks(cases, duration, 1), folder / f"check{cores}.db", folder / "answer",
        chunk=chunk, case_time=costs.case, processes=processes, threads=cores // processes,
    )  # fmt: skip


def _data(found: Measured, checks: Sequence[SimulatedSweep]) -> dict[str, object]:
    return {
        "costs": asdict(found.costs),
        "opened_memory": found.opened_memory,
        "rows_per_second": {str(chunk): rate for chunk, rate in found.rows.items()},
        "simulated": [asdict(run) for run in (*found.saturated, *checks)],
    }
