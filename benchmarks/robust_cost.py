"""What a robust step costs standing and walking, beside Pinocchio's calls and MuJoCo's step.

One process, interleaved rounds, ratios taken inside a round; every speed has its error beside it.
Writes robust_cost.md and .json.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import accuracy
import machine
import numpy as np
from motions import Motion
from mujoco_scene import CONES, SAMPLE, Array, MujocoScene
from subjects import QUICK, STEP, Size, pinocchio_calls, standing_and_walking
from timing import Quartiles, Subject, interleaved

from hexapod_pin import native
from hexapod_pin.simulation.plant import native_plant

RESULTS = Path(__file__).resolve().parent / "results"
METHODS = ("robust", "robust-reference", "implicit-euler")
OF_PINOCCHIO, OF_MUJOCO = 9.0 / 4.0, 0.8
"""Wanted: a robust step in Pinocchio's two calls, and in MuJoCo's cheapest step, at most."""


@dataclass(frozen=True)
class Row:
    """One engine on one motion.

    Attributes:
        motion: "motion/contact".
        engine: method, or MuJoCo with its cone.
        low: lower quartile of the time per step [us].
        median: [us].
        high: upper quartile [us].
        of_pinocchio: median ratio to crba + nonLinearEffects of the same round.
        of_mujoco: median ratio to MuJoCo's cheapest step of the same round.
        error: largest distance of the trunk to the engine's own reference, 10 ms grid [m].
    """

    motion: str
    engine: str
    low: float
    median: float
    high: float
    of_pinocchio: float
    of_mujoco: float
    error: float


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, print the report and write it to --out. Return 1 if a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a few seconds, rough figures")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the two files")
    options = parser.parse_args(argv)
    before = machine.describe()
    rows = measure(QUICK if options.quick else Size())
    head = machine.as_text(before, machine.load())
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "robust_cost.md").write_text(report(rows, head), encoding="utf-8")
    data = {"machine": before, "step": STEP, "rows": [asdict(row) for row in rows]}
    (options.out / "robust_cost.json").write_text(json.dumps(data, indent=1) + "\n")
    print(report(rows, head))
    return 0 if all(met(row) for row in rows if row.engine == "robust") else 1


def met(row: Row) -> bool:
    """Tell whether a robust step costs as little as wanted."""
    return row.of_pinocchio <= OF_PINOCCHIO and row.of_mujoco <= OF_MUJOCO


def measure(size: Size) -> list[Row]:
    """Time every engine on every motion, then find the errors that belong to it."""
    motions = standing_and_walking(size.duration)
    subjects = [x for name, motion in motions.items() for x in _subjects(name, motion, size)]
    samples = interleaved(subjects, size.rounds)
    return [row for name, motion in motions.items() for row in _rows(name, motion, samples, size)]


def _subjects(name: str, motion: Motion, size: Size) -> list[Subject]:
    steps = round(size.duration / STEP)
    found = [_ours(name, motion, method, steps) for method in METHODS]
    found.append(pinocchio_calls(name, motion, size.calls))
    return [*found, *(_mujoco(name, motion, cone, steps) for cone in CONES)]


def _ours(name: str, motion: Motion, method: str, steps: int) -> Subject:
    plant = native_plant(motion.scene)

    def run() -> dict[str, float]:
        rollout = motion.rollout(STEP, steps, method=method, plant=plant)
        begin = time.perf_counter()
        if not rollout.advance(1):
            raise RuntimeError(f"{name} diverged with {method}")
        return {f"{method}/{name}": (time.perf_counter() - begin) * 1e6 / steps}

    return run


def _mujoco(name: str, motion: Motion, cone: str, steps: int) -> Subject:
    run = MujocoScene(motion.scene, cone=cone, step=STEP).timed_run(
        motion.state, motion.setpoints, steps
    )
    return lambda: {f"MuJoCo {cone}/{name}": run() * 1e6 / steps}


def _rows(name: str, motion: Motion, samples: Mapping[str, Array], size: Size) -> list[Row]:
    engines = (*METHODS, *(f"MuJoCo {cone}" for cone in CONES))
    pinocchio = samples[f"pinocchio/{name}"]
    cheapest = np.minimum(*(samples[f"MuJoCo {cone}/{name}"] for cone in CONES))
    truth = positions(motion, "robust", size.fine, size.duration)
    found = []
    for engine in engines:
        taken = samples[f"{engine}/{name}"]
        if engine in METHODS:
            moved = positions(motion, engine, STEP, size.duration)
            error = float(np.linalg.norm(moved - truth, axis=1).max())
        else:
            cone = engine.rpartition(" ")[2]
            error = accuracy.mujoco(motion, cone, size.duration, STEP, size.fine).whole
        spread = Quartiles.of(taken)
        ratios = float(np.median(taken / pinocchio)), float(np.median(taken / cheapest))
        found.append(Row(name, engine, spread.low, spread.median, spread.high, *ratios, error))
    return found


def positions(motion: Motion, method: str, step: float, duration: float) -> Array:
    """Return the trunk's positions every 10 ms [m]. Shape (T, 3)."""
    run: native.Rollout = motion.rollout(step, round(SAMPLE / step), method=method)
    if not run.advance(round(duration / SAMPLE)):
        raise RuntimeError(f"diverged at a step of {step:g} s with {method}")
    found: Array = run.record()["q"][:, :3]
    return found


def report(rows: Sequence[Row], head: str) -> str:
    """Return the result as Markdown."""
    lines = [
        "# Cost of a robust step\n",
        head + "\n",
        "Kharagpur, steps of 1 ms, sampled at the end of the run only. Six feet are loaded while",
        "standing. Pinocchio: crba and nonLinearEffects in C++, same process, same round. MuJoCo:",
        "implicitfast through `mujoco.rollout`, its cheaper cone. Error: trunk against the robust",
        "step at the reference step (ours) or MuJoCo's own (MuJoCo), whole run.\n",
        "| motion / contact | engine | us per step | of Pinocchio's calls | of MuJoCo's cheapest |"
        " error [m] |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        spread = Quartiles(row.low, row.median, row.high).text()
        lines.append(
            f"| {row.motion} | {row.engine} | {spread} | {row.of_pinocchio:.2f} "
            f"| {row.of_mujoco:.2f} | {row.error:.1e} |"
        )
    fine = [row for row in rows if row.engine == "robust"]
    kept = sum(met(row) for row in fine)
    lines.append(
        f"\nWanted of the robust step: at most {OF_PINOCCHIO:.2f} of Pinocchio's calls and "
        f"{OF_MUJOCO:.1f} of MuJoCo's cheapest step. Met in {kept} of {len(fine)} motions."
    )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
