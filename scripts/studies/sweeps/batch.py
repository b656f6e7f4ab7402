"""A batch of many short walks, some of which diverge: time, memory, two threads over one."""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable
from statistics import median
from threading import Thread

import hexapod_pin as hp
from hexapod_pin.errors import DivergenceError
from hexapod_pin.simulation.open_loop import open_loop_run
from hexapod_pin.text_table import Table
from studies.study import StudyReport, verdict

MOST_MEMORY = 300.0
"""Of the process, at its largest [MB]."""

LEAST_SPEED_UP = 1.9
"""Two threads over one."""

ONE_CORE = "not judged: this machine has one core"

GAITS = 12
"""Different strokes among the walks: a gait is planned once for a robot, which takes longer than
a short walk does."""


def batch(
    *,
    cases: int = 2000,
    diverging: int = 20,
    duration: float = 1.5,
    share: int = 60,
    rounds: int = 3,
) -> StudyReport:
    """Summaries of many walks on two threads; one and two threads in turns on some of them."""
    chosen = sweep(cases, diverging, duration)
    before = peak_memory()
    begin = time.perf_counter()
    results = hp.simulate_batch(chosen, threads=2, keep="summary")
    taken, memory = time.perf_counter() - begin, peak_memory()
    good = sum(isinstance(result, hp.Summary) for result in results)
    bad = sum(isinstance(result, DivergenceError) for result in results)
    part = sweep(share, 0, duration)
    one, two, alone, beside = (
        median(times)
        for times in in_turns(
            rounds,
            lambda: hp.simulate_batch(part, threads=1, keep="summary"),
            lambda: hp.simulate_batch(part, threads=2, keep="summary"),
            lambda: advance_all(part[:8], together=False),
            lambda: advance_all(part[:8], together=True),
        )
    )
    rows = [
        ["walks", f"{cases}, {duration:g} s each", "", ""],
        ["summaries", str(good), str(cases - diverging), verdict(good == cases - diverging)],
        ["divergences", str(bad), str(diverging), verdict(bad == diverging)],
        ["wall time, two threads", f"{taken:.1f} s", "", ""],
        ["simulated over real time", f"{good * duration / taken:.0f}", "", ""],
        [
            "largest memory of the process",
            f"{memory:.0f} MB",
            f"below {MOST_MEMORY:g} MB",
            verdict(memory < MOST_MEMORY),
        ],
        ["of it before the batch", f"{before:.0f} MB", "", ""],
        [
            "two threads over one",
            f"{one / two:.2f}",
            f"at least {LEAST_SPEED_UP:g}",
            verdict(one / two >= LEAST_SPEED_UP) if (os.cpu_count() or 1) > 1 else ONE_CORE,
        ],
        ["the same of runs alone, no batch and no Python", f"{alone / beside:.2f}", "", ""],
    ]
    return StudyReport(
        "A batch of summaries",
        [
            f"Tripod walks of kharagpur at accuracy 1e-4 with {GAITS} strokes and differing servo "
            "gains and friction; those that diverge are explicit steps beyond the stability limit "
            f"of a stiff contact. The last two rows are medians of {rounds} rounds in turns over "
            f"{share} walks, and over 8 rollouts on plain threads: what the machine gives.",
            Table("", ["", "measured", "wanted", "result"], rows),
        ],
    )


def sweep(count: int, diverging: int, duration: float) -> list[hp.Case]:
    """Return walks that differ, `diverging` of them explicit and beyond their stability."""
    robot = hp.load_robot("kharagpur")
    every = count // diverging if diverging else count + 1
    stiff = hp.Scene(robot, contact=hp.Contact.s2())
    found = []
    for k in range(count):
        if diverging and k % every == every - 1 and k // every < diverging:
            found.append(
                hp.Case(stiff, hp.HoldPosture(), duration=duration, method="rk4", step=2e-3)
            )
            continue
        contact = hp.Contact.accurate().with_mu(0.4 + 0.5 * (k % 7) / 7)
        servo = hp.Servo(kp=15.0 + k % 11, kd=0.4)
        gait = hp.Gait.tripod(stroke=0.04 + 0.04 * (k % GAITS) / GAITS, cycle_time=0.5)
        scene = hp.Scene(robot, contact=contact, servo=servo)
        found.append(hp.Case(scene, hp.KinematicControl(gait), duration=duration))
    return found


def peak_memory() -> float:
    """Return the largest resident memory of this process so far [MB]."""
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return size / (2**20 if sys.platform == "darwin" else 2**10)


def in_turns(rounds: int, *jobs: Callable[[], object]) -> list[list[float]]:
    """Return the wall times of each job, the jobs taking turns [s]."""
    times: list[list[float]] = [[] for _ in jobs]
    for _ in range(rounds):
        for job, taken in zip(jobs, times, strict=True):
            begin = time.perf_counter()
            job()
            taken.append(time.perf_counter() - begin)
    return times


def advance_all(cases: list[hp.Case], *, together: bool) -> None:
    """Run rollouts one after the other, or half of them on each of two threads."""
    runs = [open_loop_run(case, case.settings, record=False) for case in cases]

    def work(part: list[object]) -> None:
        for run in part:
            run.rollout.advance(run.settings.grid.samples)  # type: ignore[attr-defined]

    halves: list[list[object]] = [list(runs[::2]), list(runs[1::2])] if together else [list(runs)]
    threads = [Thread(target=work, args=(half,)) for half in halves]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
