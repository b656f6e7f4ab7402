"""What prescribed motion costs beside servos at the same accuracy, with the errors of both."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.studies.prescribed_torque import CYCLE, torque_table, walk_of
from hexapod_pin.benchmark.studies.timing import Quartiles, interleaved
from hexapod_pin.benchmark.study import StudyReport
from hexapod_pin.simulation.native_run import open_loop_run
from hexapod_pin.validation.tables import Table

MAX_COST_RATIO = 0.7
"""Target: prescribed motion over servos at the same accuracy."""

WIDE, DEFAULT = 0.1, 2e-3
"""Sampling that does not set the steps, and the default, which does [s]."""

TIGHTER = 0.01
"""Accuracy of the runs that errors are against, of the accuracy asked for."""

HEAD = (
    "robot", "contact", "walk", "method", "sample [ms]",
    "servo, prescribed [ms]", "ratio", "evaluations", "ratio", "whole call [ms]", "ratio",
    "error of the base [m]", "error of torque RMS [%]", "at most 0.7",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """Servos and prescribed motion at one accuracy; pairs are (servo, prescribed).

    Attributes:
        scene: robot, contact, walk.
        method: by name.
        accuracy: asked for [m, rad].
        sample: [s].
        core: medians of the times in the core [s].
        core_ratio: median of the ratios, prescribed over servo, of each round.
        call: medians of the times of `hp.simulate`, planning included [s].
        call_ratio: as `core_ratio`.
        evaluations: of the equations of motion.
        base: largest distance of the base from the tighter run [m].
        rms: largest relative difference of a joint's torque RMS from the tighter run [-].
    """

    scene: tuple[str, str, str]
    method: str
    accuracy: float
    sample: float
    core: tuple[float, float]
    core_ratio: float
    call: tuple[float, float]
    call_ratio: float
    evaluations: tuple[int, int]
    base: tuple[float, float]
    rms: tuple[float, float]

    @property
    def met(self) -> bool:
        """Whether integration is cheap enough."""
        return self.core_ratio <= MAX_COST_RATIO

    def cells(self) -> list[str]:
        """Return its line."""
        evaluations = self.evaluations[1] / self.evaluations[0]
        return [
            *self.scene, f"{self.method} {self.accuracy:.0e}", f"{1e3 * self.sample:g}",
            _pair(self.core, 1e3, ".1f"), f"{self.core_ratio:.2f}",
            _pair(self.evaluations, 1, "d"), f"{evaluations:.2f}",
            _pair(self.call, 1e3, ".1f"), f"{self.call_ratio:.2f}",
            _pair(self.base, 1.0, ".1e"), _pair(self.rms, 100.0, ".2g"),
            "pass" if self.met else "FAIL",
        ]  # fmt: skip


def _pair(values: tuple[float, float], factor: float, form: str) -> str:
    return ", ".join(f"{factor * value:{form}}" for value in values)


def prescribed_cost(
    *,
    rounds: int = 5,
    cycles: int = 3,
    robots: str = "kharagpur,athena",
    contacts: str = "accurate,s1,s2",
    walks: str = "tetrapod,arc constant,arc step",
    accuracies: str = "1e-3,1e-4,1e-5,1e-6",
    factors: str = "1,4,16,64,256",
) -> StudyReport:
    """Cost and torques of prescribed motion beside servos, with errors; stiffer servos too."""
    ways: list[dict[str, Any]] = [{"accuracy": float(a)} for a in accuracies.split(",")]
    ways.append({"accuracy": 1e-6, "method": "ndf"})
    scenes = [
        (robot, contact, walk)
        for robot, contact, walk in product(
            robots.split(","), contacts.split(","), walks.split(",")
        )
        if robot == "kharagpur" or walk == "tetrapod"
    ]
    wide, narrow = [], []
    for scene in scenes:
        print("...", *scene, file=sys.stderr, flush=True)
        wide += [measure(scene, how, WIDE, cycles, rounds) for how in ways]
        if scene[2] == scenes[0][2]:
            narrow.append(measure(scene, {"accuracy": 1e-4}, DEFAULT, cycles, rounds))
    torques, torques_met = torque_table(scenes, cycles, [float(f) for f in factors.split(",")])
    return StudyReport(
        "What prescribed motion costs, and what servos come to",
        [
            _about(cycles, rounds),
            Table("Cost, samples every 0.1 s", HEAD, [row.cells() for row in wide]),
            _verdict(wide),
            Table("Cost, samples every 2 ms (the default)", HEAD, [r.cells() for r in narrow]),
            _verdict(narrow),
            torques,
        ],
        met=torques_met and all(row.met for row in (*wide, *narrow)),
    )


def measure(
    scene: tuple[str, str, str], how: dict[str, Any], sample: float, cycles: int, rounds: int
) -> Row:
    """Time one walk in both ways, and compare each with a run at a hundredth of its accuracy."""
    pair = [_case(scene, on, cycles, sample=sample, **how) for on in (False, True)]
    exact = {"method": "ndf", "accuracy": TIGHTER * how["accuracy"]}
    tight = [_case(scene, on, cycles, sample=sample, **exact).run() for on in (False, True)]
    found = [case.run() for case in pair]
    subjects = {f"{kind} {k}": kind_of(pair[k]) for kind, kind_of in TIMES.items() for k in (0, 1)}
    times = interleaved(subjects, rounds)
    errors = [_errors(a, b) for a, b in zip(found, tight, strict=True)]
    spent = {name: Quartiles.of(values).median for name, values in times.items()}
    ratios = [Quartiles.of(times[f"{k} 1"] / times[f"{k} 0"]).median for k in TIMES]
    return Row(
        scene=scene,
        method=pair[0].settings.choice.method.name,
        accuracy=how["accuracy"],
        sample=sample,
        core=(spent["core 0"], spent["core 1"]),
        core_ratio=ratios[0],
        call=(spent["call 0"], spent["call 1"]),
        call_ratio=ratios[1],
        evaluations=(
            int(found[0].counters["evaluations"]),
            int(found[1].counters["evaluations"]),
        ),
        base=(errors[0][0], errors[1][0]),
        rms=(errors[0][1], errors[1][1]),
    )


def _errors(found: hp.Trace, tight: hp.Trace) -> tuple[float, float]:
    """Return distance of the base [m] and relative difference of a joint's torque RMS, largest."""
    distance = np.linalg.norm(found.q[:, :3] - tight.q[:, :3], axis=1).max()
    return float(distance), float(np.abs(_rms(found) / _rms(tight) - 1.0).max())


def _case(scene: tuple[str, str, str], prescribed: bool, cycles: int, **how: Any) -> hp.Case:
    robot, contact, walk = scene
    laws = hp.Contact.preset(contact)
    built = hp.Scene(hp.load_robot(robot), contact=laws, prescribed=prescribed)
    return hp.Case(built, walk_of(robot, walk), duration=cycles * CYCLE, **how)


def _rms(trace: hp.Trace) -> Array:
    """Return the RMS torque of every joint over the samples behind the first cycle [N m]."""
    torque = trace.torque[trace.time > CYCLE]
    found: Array = np.sqrt((torque**2).mean(axis=0))
    return found


def _core(case: hp.Case) -> Callable[[], float]:
    def run() -> float:
        under_way = open_loop_run(case, case.settings)
        under_way.advance()
        return under_way.wall_time

    return run


def _call(case: hp.Case) -> Callable[[], float]:
    def run() -> float:
        begin = time.perf_counter()
        case.run()
        return time.perf_counter() - begin

    return run


TIMES: dict[str, Callable[[hp.Case], Callable[[], float]]] = {"core": _core, "call": _call}


def _verdict(rows: Sequence[Row]) -> str:
    ratios = np.array([row.core_ratio for row in rows])
    calls = np.array([row.call_ratio for row in rows])
    missed = int(sum(not row.met for row in rows))
    beyond = [sum(row.base[k] > row.accuracy for row in rows) for k in (0, 1)]
    worst = [max(row.base[k] / row.accuracy for row in rows) for k in (0, 1)]
    return (
        f"Integration: ratio {np.median(ratios):.2f} (median; {ratios.min():.2f} to "
        f"{ratios.max():.2f}), {missed} of {len(rows)} rows above {MAX_COST_RATIO:g}. Whole call: "
        f"{np.median(calls):.2f} ({calls.min():.2f} to {calls.max():.2f}), "
        f"{int((calls > MAX_COST_RATIO).sum())} of {len(rows)} above it. Errors of the base "
        f"above the accuracy asked for: servos {beyond[0]} rows (most {worst[0]:.2g} times), "
        f"prescribed {beyond[1]} (most {worst[1]:.2g} times)."
    )


def _about(cycles: int, rounds: int) -> str:
    return (
        f"Walks of {cycles} cycles of {CYCLE:g} s, stroke 0.14 m or 80 % of the longest (arcs: "
        f"20 degrees); default servos. One core, {rounds} interleaved rounds: medians, and medians "
        "of the ratios of each round. Cells with a comma: servo, prescribed. The verdict is on the "
        "time in the core, from the first step to the last sample; the whole call also plans the "
        "walk and builds the trace, alike for both. Errors: largest distance of the base and "
        "largest difference of a joint's torque RMS behind the first cycle, each from a run of its "
        f"own kind with ndf at {TIGHTER:g} of the accuracy. "
        "Servo and prescribed torques differ by more than that: last table."
    )
