"""What one evaluation and one stance cost in each formulation, side by side.

One process, one thread, interleaved rounds. Writes formulations.md and .json.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # 24 x 24: threads only wait for each other

import machine  # noqa: E402
import numpy as np  # noqa: E402
from timing import Quartiles  # noqa: E402

import hexapod_pin as hp  # noqa: E402
from hexapod_pin import native  # noqa: E402
from hexapod_pin.formulations.inverse import (  # noqa: E402
    Compliant,
    LeastTorque,
    MinimumNorm,
    inverse_dynamics,
)
from hexapod_pin.formulations.rigid import RigidModel, derivative, plastic_impact  # noqa: E402
from hexapod_pin.simulation.plant import native_plant  # noqa: E402
from hexapod_pin.validation.checks.limits import slow_gait, tripod  # noqa: E402
from hexapod_pin.validation.checks.maximal_checks import maximal_twin, pressed_states  # noqa: E402
from hexapod_pin.validation.checks.pinocchio_contacts import constrained_motion  # noqa: E402

RESULTS = Path(__file__).resolve().parent / "results"
STIFFNESS = (1e4, 1e5, 1e6, 1e7, 1e8, 1e9)
Row = tuple[str, str, Callable[[], object], int]


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, print and write to --out. Return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the two files")
    options = parser.parse_args(argv)
    before, found = machine.describe(), measure(subjects(), options.rounds)
    limits = [(k, tripod(k), slow_gait(k)) for k in STIFFNESS]
    text = report(machine.as_text(before, machine.load()), found, limits)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "formulations.md").write_text(text, encoding="utf-8")
    data = {
        "machine": before,
        "microseconds": {row[0]: times.tolist() for row, times in found},
        "limits": [
            {"stiffness": k, "tripod": vars(stance), "gait": vars(gait)}
            for k, stance, gait in limits
        ],
    }
    (options.out / "formulations.json").write_text(json.dumps(data, indent=1) + "\n")
    print(text)
    return 0


def subjects() -> list[Row]:
    """Return name, how it was called, the call, and how many calls a round has."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    q, v, torque = pressed_states(scene, 1)[0]
    model, plant, twin = RigidModel(scene.robot), native_plant(scene), maximal_twin(scene)
    point = RigidModel(hp.load_robot("kharagpur", foot_radius=0.0))
    feet, a = range(6), np.zeros(24)
    return [
        ("Pinocchio's calls of one core evaluation", "C++, loop in C++",
         lambda: native.repeat_dynamics(plant, q, v, 1000), 1000),
        ("core, native.evaluate", "C++, one call from Python",
         lambda: native.evaluate(plant, q, v, torque), 1),
        ("S2 eqs. 1-4, six feet stuck", "Python on Pinocchio",
         lambda: derivative(model, hp.State(q, v), torque, feet), 1),
        ("pin.constraintDynamics, six point feet", "C++, set up in Python each time",
         lambda: constrained_motion(point, q, v, torque, feet), 1),
        ("S2 eq. 5, six feet", "Python on Pinocchio",
         lambda: plastic_impact(model, q, v, (), feet), 1),
        ("S1 maximal coordinates", "Python, numpy",
         lambda: twin.acceleration((q, v, torque)), 1),
        ("inverse dynamics, minimum norm", "Python on Pinocchio",
         lambda: inverse_dynamics(model, q, v, a, feet, MinimumNorm()), 1),
        ("inverse dynamics, compliant", "Python on Pinocchio",
         lambda: inverse_dynamics(model, q, v, a, feet, Compliant(servo=240.0)), 1),
        ("inverse dynamics, least torque", "Python on Pinocchio, nnls",
         lambda: inverse_dynamics(model, q, v, a, feet, LeastTorque(limited=False)), 1),
    ]  # fmt: skip


def measure(rows: list[Row], rounds: int) -> list[tuple[Row, Any]]:
    """Return the time of a call in every round [us], rounds interleaved."""
    times = np.zeros((len(rows), rounds))
    for turn in range(-2, rounds):
        for k, (_, _, call, calls) in enumerate(rows):
            repeat = 1 if calls > 1 else 20
            begin = time.perf_counter()
            for _ in range(repeat):
                call()
            if turn >= 0:
                times[k, turn] = 1e6 * (time.perf_counter() - begin) / (repeat * calls)
    return list(zip(rows, times, strict=True))


def report(where: str, found: list[tuple[Row, Any]], limits: list[Any]) -> str:
    """Return the page."""
    lines = ["# Cost of one evaluation, by formulation", "", "`python benchmarks/formulations.py`",
             "", where, "", "kharagpur, 24 velocities, a random state on five or six feet; medians",
             "with quartiles in brackets.", "", "| formulation | called | us per evaluation |",
             "| --- | --- | --- |"]  # fmt: skip
    for (name, how, _, _), times in found:
        lines.append(f"| {name} | {how} | {Quartiles.of(times).text()} |")
    lines += ["", "## Stiff contact against rigid contact", "",
              "Linear springs K and matched dampers in both directions, feet that never slip.",
              "Force: largest difference over the weight; torque: largest difference.", "",
              "| K [N/m] | tripod: force | torque [N m] | evaluations | wall [ms] "
              "| slow gait: force | torque [N m] | evaluations | wall [ms] |",
              "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"]  # fmt: skip
    for k, *both in limits:
        cells = [f"{x.force:.1e} | {x.torque:.1e} | {x.evaluations} | {1e3 * x.wall:.1f}"
                 for x in both]  # fmt: skip
        lines.append(f"| {k:.0e} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
