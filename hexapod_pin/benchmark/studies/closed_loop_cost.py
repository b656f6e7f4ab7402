"""What 200 Hz control costs: foot forces read, inverse kinematics anew at every tick."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.studies.timing import Quartiles, interleaved
from hexapod_pin.benchmark.study import StudyReport
from hexapod_pin.control import FootPath, SixLegs, six_legs
from hexapod_pin.simulation.closed_loop import lock_step_runs
from hexapod_pin.validation.tables import Table

MIN_SINGLE, MIN_LOCK_STEP = 30.0, 100.0
"""Targets: times real time of one run, and per case of LOCK_STEP side by side."""

LOCK_STEP = 64
PERIOD = 0.005
"""[s]"""

REFERENCE_ACCURACY = 1e-8
"""[m and rad]"""

GAITS = {
    "kharagpur": hp.Gait.tetrapod(stroke=0.10, cycle_time=1.2),
    "athena": hp.Gait.tripod(stroke=0.08, cycle_time=1.6),
}


@dataclass(frozen=True, eq=False)
class YieldingWalk:
    """Walks a gait whose feet give way to their load, by inverse kinematics at every tick.

    Attributes:
        robot: the robot.
        gait: the gait.
        length: of the walk [s].
        compliance: how far a foot gives way [m/N].
    """

    robot: hp.Robot
    gait: hp.Gait
    length: float
    compliance: float = 5e-5
    period: float = PERIOD

    @cached_property
    def legs(self) -> SixLegs:
        """The legs."""
        return six_legs(self.robot)

    @cached_property
    def targets(self) -> Array:
        """Feet in the base frame at the end of every tick [m]. Shape (ticks, 6, 3)."""
        ticks = np.arange(1, round(self.length / self.period) + 2)
        return FootPath.of(self.legs, self.gait).positions(self.period * ticks)

    def start(self, scene: hp.Scene, batch: int) -> Array:
        """Return the filtered loads [N]. Shape (B, 6)."""
        return np.zeros((batch, 6))

    def update(self, at: float, m: hp.Measurement, load: Array) -> tuple[hp.Command, Array]:
        """Return the set-points that the feet's loads ask for."""
        load = load + 0.1 * (m.foot_force[..., 2] - load)
        feet = np.repeat(self.targets[None, round(at / self.period)], len(load), axis=0)
        feet[..., 2] += self.compliance * load
        return hp.Command(self.legs.joint_angles(feet, m.q), ramp=True), load


def closed_loop_cost(
    *, duration: float = 4.0, rounds: int = 5, accuracy: float = 1e-4
) -> StudyReport:
    """Times real time of one run and of 64 in lock-step, beside the open-loop walk; errors too."""
    rows, met = [], True
    for name in GAITS:
        subjects = _subjects(name, duration, accuracy)
        times = {k: Quartiles.of(v) for k, v in interleaved(subjects, rounds).items()}
        error = _error(name, min(duration, 0.6), accuracy)
        for subject, found in times.items():
            target = {"single": MIN_SINGLE, "lock-step": MIN_LOCK_STEP}.get(subject)
            verdict = "-"
            if target is not None:
                good = found.median >= target
                met &= good
                verdict = f"{'pass' if good else 'FAIL'} (at least {target:g})"
            shown = "-" if subject == "open loop" else f"{error:.1e}"
            rows.append([name, subject, found.text(".0f"), shown, verdict])
    head = ["robot", "run", "times real time, per case", "error [m or rad]", "target"]
    return StudyReport(
        "What closed-loop control costs",
        [
            f"Walks of {duration:g} s at accuracy {accuracy:g}, one core, {rounds} interleaved "
            f"rounds (median, quartiles). Control at {1 / PERIOD:g} Hz: foot forces read, inverse "
            f"kinematics of all legs anew at every tick, set-points ramped between ticks; samples "
            f"every {1e3 * PERIOD:g} ms. Lock-step: {LOCK_STEP} cases, summaries only. Error: "
            f"largest in q over 0.6 s, against the same loop at accuracy {REFERENCE_ACCURACY:g}.",
            Table("", head, rows),
        ],
        met=met,
    )


def _subjects(name: str, duration: float, accuracy: float) -> dict[str, Callable[[], float]]:
    robot, gait = hp.load_robot(name), GAITS[name]
    scene, control = hp.Scene(robot), YieldingWalk(robot, gait, duration)
    how: dict[str, Any] = {"duration": duration, "accuracy": accuracy, "sample": PERIOD}
    cases = [hp.Case(scene, control, **how) for _ in range(LOCK_STEP)]

    def speed(run: Callable[[], object], count: int = 1) -> Callable[[], float]:
        def timed() -> float:
            begin = time.perf_counter()
            run()
            return count * duration / (time.perf_counter() - begin)

        return timed

    return {
        "open loop": speed(lambda: hp.simulate(scene, hp.KinematicControl(gait), **how)),
        "single": speed(lambda: hp.simulate(scene, control, **how)),
        "lock-step": speed(
            lambda: lock_step_runs(cases, cases[0].settings, record=False), LOCK_STEP
        ),
    }


def _error(name: str, duration: float, accuracy: float) -> float:
    """Return the largest difference in q to the same loop at REFERENCE_ACCURACY."""
    robot, gait = hp.load_robot(name), GAITS[name]
    control = YieldingWalk(robot, gait, duration)
    found = [
        hp.simulate(hp.Scene(robot), control, duration=duration, sample=PERIOD, accuracy=wanted).q
        for wanted in (accuracy, REFERENCE_ACCURACY)
    ]
    return float(np.abs(found[0] - found[1]).max())
