"""What a step, a walk and a batch cost, beside MuJoCo and Pinocchio, and how accurate they are."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.arrays import Array
from hexapod_pin.errors import DivergenceError
from hexapod_pin.text_table import Table
from studies.cost.native_motion import NativeMotion
from studies.cost.step_entries import (
    MUJOCO,
    PINOCCHIO,
    QUICK_SIZE,
    STEP,
    StepRow,
    StepStudySize,
    TrunkError,
    measure_steps,
    own_step,
    rows_data,
    standing_and_walking,
    yardsticks,
)
from studies.cost.timing import Quartiles, interleaved
from studies.study import StudyReport, verdict

MAX_OF_MUJOCO, MAX_OF_PINOCCHIO, MIN_REAL_TIME, MIN_THREADS = 0.5, 1.4, 100.0, 1.8
"""Targets: step over MuJoCo's, over Pinocchio's calls; times real time; two threads over one."""

OURS, SAMPLED, DENSE = (
    "hexapod_pin",
    "hexapod_pin, sampling every step",
    "hexapod_pin, dense solver",
)
SHORTEST_STROKE, LONGEST_STROKE = 0.08, 0.14
"""In a batch [m]: cases differ, as in a sweep."""

SLICE = 256
"""Samples by which a run of a batch advances at a time."""

PATIENCE = 3600.0
"""Longest wait for the next run of a batch [s]."""

ERROR_HEAD = (
    "error, first 1 s [m]",
    "error, whole run [m]",
    "reference [m]",
    "feet down",
    "counts",
)

NOTES = """Robot kharagpur from one URDF in both engines, motions from standing: hold, and tripod
and tetrapod of 0.14 m in 2.4 s; interleaved rounds; medians with quartiles in brackets; ratios are
taken inside a round. Ours: linearly implicit Euler. MuJoCo: implicitfast, default solver, loop in C
(`mujoco.rollout`), one thread, the same servos, effort limits, coefficient of friction (s1 0.7,
s2 0.3) and set-points (at the end of each step, as in ours); only feet meet the floor; joint limits
off, visual shapes dropped, fixed links fused.

**The contact laws differ**: ours is a compliant foot (s1: Hertz and tanh friction; s2: ADAMS
IMPACT and two-speed friction), MuJoCo's a soft constraint with its default parameters. So a ratio
compares the cost of walking this robot, not of solving the same equations. Each error is the
largest distance of the trunk, on a 10 ms grid, from that engine's own run of the same method at a
fine step (MuJoCo's with a solver tolerance of 1e-12); "reference" is how far that run moves when
its step is doubled: an error below it is not resolved. A run begins with the feet just touching:
settling is part of every error. "Counts": ours solves a step again when a servo reaches its limit,
a foot lets go or its slip reverses; MuJoCo's solver iterations are means over 10 ms samples.

Pinocchio's crba + nonLinearEffects in C++, what mass matrix and bias cost with it: the yardstick. A
step takes both from its own fused pass (`native/`)."""


@dataclass(frozen=True)
class RunSizes:
    """Of the long runs: walk [s], each walk of a batch [s], walks in a batch."""

    walk: float = 10.0
    batch: float = 4.0
    cases: int = 32


@dataclass(frozen=True)
class Target:
    """A ratio with its bound."""

    what: str
    values: Array
    bound: float
    at_most: bool

    @property
    def met(self) -> bool:
        """Whether the median is within the bound."""
        median = Quartiles.of(self.values).median
        return median <= self.bound if self.at_most else median >= self.bound

    def row(self, *, quick: bool = False) -> list[str]:
        """Return the row of the table; the rough figures of a quick run are not judged."""
        form = ".2f" if self.bound < MIN_REAL_TIME else ".0f"
        bound = f"{'at most' if self.at_most else 'at least'} {self.bound:g}"
        said = "not judged: quick run" if quick else verdict(self.met)
        return [self.what, Quartiles.of(self.values).text(form), bound, said]


def step_cost(*, quick: bool = False) -> StudyReport:
    """Cost of a step beside its error; quick: half a minute, rough figures."""
    size = QUICK_SIZE if quick else StepStudySize()
    sizes = RunSizes(walk=0.5, batch=0.2, cases=4) if quick else RunSizes()
    motions = standing_and_walking(size.duration)
    entries = {
        name: {
            OURS: own_step(motion, size),
            **yardsticks(motion, size),
            SAMPLED: own_step(motion, size, stride=1),
            **({DENSE: own_step(motion, size, dense=True)} if name == "tetrapod/s1" else {}),
        }
        for name, motion in motions.items()
    }
    rows = measure_steps(entries, size)
    runs = interleaved(_long_runs(sizes), size.rounds)
    targets, same = _targets(rows, runs, sizes), same_bits(sizes)
    dense = _dense_difference(motions["tetrapod/s1"], size)
    warning = ["**Quick run: only shows that the script works.**"] if quick else []
    bits = "the same bits" if same else "**DIFFERENT bits**"
    return StudyReport(
        "Cost of a step, beside its error",
        [
            *warning, NOTES,
            f"Steps of {STEP * 1e3:g} ms, motions of {size.duration:g} s, references at "
            f"{size.fine:g} s, {size.rounds} rounds. The dense solver's walk is {dense:.0e} m from "
            f"the block-arrow solver's. One and two threads gave {bits}.",
            Table("Targets", ("ratio", "median (quartiles)", "target", "result"),
                  [target.row(quick=quick) for target in targets]),
            _steps_table(rows), _runs_table(runs, sizes, size),
        ],
        {
            "quick": quick, "step": STEP, "size": asdict(size), "runs": asdict(sizes),
            "rows": rows_data(rows), "seconds": {name: x.tolist() for name, x in runs.items()},
            "targets": [{**asdict(Quartiles.of(x.values)), "what": x.what, "bound": x.bound,
                         "met": x.met} for x in targets],
            "dense_difference": dense, "same_bits": same,
        },
    )  # fmt: skip


def _dense_difference(motion: NativeMotion, size: StepStudySize) -> float:
    arrow, dense = (motion.path(STEP, size.duration, dense=dense) for dense in (False, True))
    return float(np.abs(dense.positions - arrow.positions).max())


# --- long runs ----------------------------------------------------------------------------------


def _long_runs(sizes: RunSizes) -> dict[str, Callable[[], float]]:
    """Return what times a walk through `hp.simulate`, its rollout alone, and batches [s]."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    controller, motions = hp.KinematicControl(hp.Gait.tetrapod()), batch_motions(sizes)

    def call() -> float:
        begin = time.perf_counter()
        hp.simulate(scene, controller, duration=sizes.walk, step=STEP)
        return time.perf_counter() - begin

    def rollout() -> float:
        trace = hp.simulate(scene, controller, duration=sizes.walk, step=STEP)
        return trace.run.wall_time or 0.0

    return {
        "walk/call": call, "walk/rollout": rollout,
        "batch/1": lambda: advance(motions, sizes.batch, 1)[0],
        "batch/2": lambda: advance(motions, sizes.batch, 2)[0],
    }  # fmt: skip


def batch_motions(sizes: RunSizes) -> list[NativeMotion]:
    """Return the walks of a batch: tetrapods of different strokes."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    strokes = np.linspace(LONGEST_STROKE, SHORTEST_STROKE, sizes.cases)
    gaits = [hp.Gait.tetrapod(stroke=float(stroke)) for stroke in strokes]
    return [NativeMotion.of(scene, hp.KinematicControl(gait), sizes.batch) for gait in gaits]


def advance(
    motions: list[NativeMotion], duration: float, threads: int
) -> tuple[float, list[native.Rollout]]:
    """Run a batch as `hp.simulate_batch` does; return the wall time [s] and the runs."""
    runs = [motion.rollout(STEP, 1) for motion in motions]
    begin = time.perf_counter()
    batch = native.Batch(threads)
    for run in runs:
        run.reserve(round(duration / STEP))
        batch.add(run, round(duration / STEP), SLICE)
    good = [batch.next_done(PATIENCE)[1] for _ in runs]
    taken = time.perf_counter() - begin
    if not all(good):
        raise DivergenceError("a walk of the batch diverged", None)
    return taken, runs


def same_bits(sizes: RunSizes) -> bool:
    """Say whether one and two threads give the same bits in every sampled quantity."""
    motions = batch_motions(sizes)
    one, two = ([run.record() for run in advance(motions, sizes.batch, n)[1]] for n in (1, 2))
    return all(
        np.array_equal(a[name], b[name]) for a, b in zip(one, two, strict=True) for name in a
    )


# --- targets and tables -------------------------------------------------------------------------


def _targets(rows: Sequence[StepRow], runs: dict[str, Array], sizes: RunSizes) -> list[Target]:
    """Return every ratio that has a target, per round."""
    by = {(row.motion, row.entry): row for row in rows}
    ours = [row for row in rows if row.entry == OURS]
    return [
        *(Target(f"step / {MUJOCO[0]}, {row.motion}",
                 row.samples / by[row.motion, MUJOCO[0]].samples, MAX_OF_MUJOCO, True)
          for row in ours),
        *(Target(f"step / {PINOCCHIO}, {row.motion}", row.of_pinocchio, MAX_OF_PINOCCHIO, True)
          for row in ours),
        Target("walk through hp.simulate, times real time", sizes.walk / runs["walk/call"],
               MIN_REAL_TIME, False),
        Target("the same, rollout alone", sizes.walk / runs["walk/rollout"], MIN_REAL_TIME, False),
        Target("batch, two threads over one", runs["batch/1"] / runs["batch/2"], MIN_THREADS,
               False),
    ]  # fmt: skip


def _steps_table(rows: Sequence[StepRow]) -> Table:
    """Every entry on every motion, the error in the same row as the speed."""
    head = (
        "motion / contact", "entry", "us per step", "of MuJoCo's cheapest", "times real time",
        *ERROR_HEAD,
    )  # fmt: skip
    cells = []
    for row in rows:
        cost, real = Quartiles.of(row.samples), "-"
        if row.error is not None:
            real = f"{STEP * 1e6 / cost.median:.0f}"
        share = f"{np.median(row.of_mujoco):.2f}"
        cells.append([row.motion, row.entry, cost.text(), share, real, *_errors(row.error)])
    return Table("Steps", head, cells)


def _runs_table(runs: dict[str, Array], sizes: RunSizes, size: StepStudySize) -> Table:
    """The long walk and the batch; errors and counts of the batch are those of its first walk."""
    scene, many = hp.Scene(hp.load_robot("kharagpur")), sizes.cases * sizes.batch
    control = hp.KinematicControl(hp.Gait.tetrapod())
    walk, first = NativeMotion.of(scene, control, sizes.walk), batch_motions(sizes)[0]
    errors = {}
    for name, motion, duration in (("walk", walk, sizes.walk), ("batch", first, sizes.batch)):

        def path(h: float, motion: Any = motion, duration: float = duration) -> Any:
            return motion.path(h, duration)

        errors[name] = TrunkError.of(path, path, size.fine)
    rows = []
    for name, what, simulated in (
        ("walk/call", f"walk of {sizes.walk:g} s, hp.simulate, whole call", sizes.walk),
        ("walk/rollout", "the same, rollout alone", sizes.walk),
        ("batch/1", f"{sizes.cases} walks of {sizes.batch:g} s, native part, 1 thread", many),
        ("batch/2", "the same, 2 threads", many),
    ):
        wall, speed = Quartiles.of(runs[name]), Quartiles.of(simulated / runs[name])
        own = _errors(errors[name.partition("/")[0]])
        rows.append([what, wall.text(".3f"), speed.text(".0f"), *own])
    head = ("run", "wall time [s]", "times real time", *ERROR_HEAD)
    return Table("Runs: tetrapod, default contact, sampled every step", head, rows)


def _errors(error: TrunkError | None) -> list[str]:
    if error is None:
        return ["-"] * len(ERROR_HEAD)
    sizes = (error.first_second, error.whole, error.uncertainty)
    counts = ", ".join(f"{name} {value:g}" for name, value in sorted(error.counters.items()))
    return [*(f"{x:.1e}" for x in sizes), f"{error.feet_down:.1f}", counts]
