"""What 200 Hz control costs: foot forces read, inverse kinematics anew at every tick."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control import FootPath, LegGroup, leg_group
from hexapod_pin.simulation.session import lock_step_runs
from hexapod_pin.text_table import Table
from studies.cost.timing import Quartiles, interleaved
from studies.study import StudyReport

MIN_SINGLE, MIN_LOCK_STEP = 30.0, 100.0
"""Targets: times real time of one run, and per case of LOCK_STEP side by side."""

LOCK_STEP = 64
PERIOD = 0.005
"""[s]"""

FOOT_CONTROL: dict[str, dict[str, Any]] = {
    "both": {"slip": hp.foot_control.SlipPid(), "suspension": hp.foot_control.VirtualSuspension()},
    "all": {
        "slip": hp.foot_control.SlipPid(),
        "suspension": hp.foot_control.VirtualSuspension(),
        "touch_down": hp.foot_control.TouchDown(),
        "levelling": hp.foot_control.Levelling(),
    },
}
"""Foot control that is timed, by name."""

REFERENCE: dict[str, Any] = {"method": "ndf", "accuracy": 1e-8}
CHECKED = 0.6
"""[s]"""

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
    def legs(self) -> LegGroup:
        """The legs."""
        return leg_group(self.robot)

    @cached_property
    def targets(self) -> Array:
        """Feet in the base frame at the end of every tick [m]. Shape (ticks, 6, 3)."""
        ticks = np.arange(1, round(self.length / self.period) + 2)
        return FootPath.of(self.legs, self.gait).positions(self.period * ticks)

    def start(self, scene: hp.Scene, batch: int) -> Array:
        """Return the filtered loads [N]. Shape (B, 6)."""
        return np.zeros((batch, 6))

    def update(
        self, at: float, m: hp.feedback.Measurement, load: Array
    ) -> tuple[hp.feedback.Command, Array]:
        """Return the set-points that the feet's loads ask for."""
        load = load + 0.1 * (m.foot_force[..., 2] - load)
        feet = np.repeat(self.targets[None, round(at / self.period)], len(load), axis=0)
        feet[..., 2] += self.compliance * load
        return hp.feedback.Command(self.legs.joint_angles(feet, m.q), ramp=True), load


def closed_loop_cost(
    *,
    duration: float = 4.0,
    rounds: int = 5,
    accuracy: float = 1e-4,
    steps: str = "0.001,0.0025",
    controls: str = "yielding,both,all",
    robots: str = ",".join(GAITS),
) -> StudyReport:
    """Times real time of one run and of 64 in lock-step, beside the open-loop walk; errors too."""
    rows, met = [], True
    methods: dict[str, dict[str, Any]] = {
        f"extrapolated-euler {accuracy:g}": {"accuracy": accuracy, "method": "extrapolated-euler"},
        **{
            f"robust {1e3 * float(step):g} ms": {"method": "robust", "step": float(step)}
            for step in steps.split(",")
        },
    }
    for name in robots.split(","):
        exact = {control: _angles(name, control, REFERENCE) for control in controls.split(",")}
        for method, how in methods.items():
            subjects = _subjects(name, duration, how, list(exact))
            times = {k: Quartiles.of(v) for k, v in interleaved(subjects, rounds).items()}
            errors = {
                control: f"{np.abs(_angles(name, control, how) - q).max():.1e}"
                for control, q in exact.items()
            }
            for subject, found in times.items():
                good, verdict = _verdict(subject, found.median)
                met &= good
                shown = errors.get(subject.partition(", ")[0], "-")
                rows.append([name, method, subject, found.text(".0f"), shown, verdict])
    head = ["robot", "method", "run", "times real time, per case", "error [m or rad]", "target"]
    return StudyReport(
        "What closed-loop control costs",
        [
            f"Walks of {duration:g} s, one core, {rounds} interleaved rounds (median, quartiles). "
            f"Control at {1 / PERIOD:g} Hz: foot forces read, inverse kinematics of all legs anew "
            f"at every tick, set-points ramped between ticks; samples every {1e3 * PERIOD:g} ms. "
            "Yielding: a controller in NumPy whose feet give way to their loads. Both and all: "
            "`hp.FootControl` with slip correction and suspension, and with touch-down and "
            "levelling too. "
            f"Lock-step: {LOCK_STEP} cases, summaries only. Error: largest in q over {CHECKED:g} s "
            f"against the same loop with {REFERENCE['method']} at {REFERENCE['accuracy']:g}; a "
            "force read in the middle of a transient makes much of a small error.",
            Table("", head, rows),
        ],
        met=met,
    )


def _verdict(subject: str, speed: float) -> tuple[bool, str]:
    kind = subject.partition(", ")[2]
    target = {"single": MIN_SINGLE, "lock-step": MIN_LOCK_STEP}.get(kind)
    if target is None:
        return True, "-"
    good = speed >= target
    return good, f"{'pass' if good else 'FAIL'} (at least {target:g})"


def _controllers(name: str, duration: float) -> dict[str, Any]:
    """Return what is timed, by name."""
    gait = GAITS[name]
    found: dict[str, Any] = {"yielding": YieldingWalk(hp.load_robot(name), gait, duration)}
    return found | {key: hp.FootControl(gait, **parts) for key, parts in FOOT_CONTROL.items()}


def _subjects(
    name: str, duration: float, how: dict[str, Any], controls: Sequence[str]
) -> dict[str, Callable[[], float]]:
    scene = hp.Scene(hp.load_robot(name))
    how = {"duration": duration, "sample": PERIOD, **how}

    def speed(run: Callable[[], object], count: int = 1) -> Callable[[], float]:
        def timed() -> float:
            begin = time.perf_counter()
            run()
            return count * duration / (time.perf_counter() - begin)

        return timed

    def single(control: Any) -> Callable[[], float]:
        return speed(lambda: hp.simulate(scene, control, **how))

    def lock_step(control: Any) -> Callable[[], float]:
        cases = [hp.Case(scene, control, **how) for _ in range(LOCK_STEP)]
        return speed(lambda: lock_step_runs(cases, cases[0].settings, record=False), LOCK_STEP)

    found = {"open loop": single(hp.KinematicControl(GAITS[name]))}
    controllers = _controllers(name, duration)
    for key in controls:
        control = controllers[key]
        found |= {f"{key}, single": single(control), f"{key}, lock-step": lock_step(control)}
    return found


def _angles(name: str, control: str, how: dict[str, Any]) -> Array:
    """Return q at the samples of the loop."""
    scene, walk = hp.Scene(hp.load_robot(name)), _controllers(name, CHECKED)[control]
    return hp.simulate(scene, walk, duration=CHECKED, sample=PERIOD, **how).q
