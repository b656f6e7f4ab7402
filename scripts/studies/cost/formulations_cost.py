"""What one evaluation and one stance cost in each formulation, side by side."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # 24 x 24: threads only wait for each other

import numpy as np

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.formulations.inverse import (
    Compliant,
    LeastTorque,
    MinimumNorm,
    inverse_dynamics,
)
from hexapod_pin.formulations.rigid import RigidModel, derivative, plastic_impact
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.text_table import Table
from hexapod_pin.validation.checks.limit_checks import slow_gait, tripod
from hexapod_pin.validation.checks.maximal_checks import maximal_twin, pressed_states
from hexapod_pin.validation.checks.samples import constrained_motion
from studies.cost.timing import Quartiles, interleaved
from studies.study import StudyReport

STIFFNESSES = (1e4, 1e5, 1e6, 1e7, 1e8, 1e9)
"""[N/m]"""

CALLS_PER_ROUND = 20


@dataclass(frozen=True)
class TimedCall:
    """A formulation, how it is called, the call, and how many evaluations a call makes."""

    name: str
    called: str
    call: Callable[[], object]
    evaluations: int = 1

    def microseconds(self) -> float:
        """Return the time of an evaluation [us]."""
        repeat = 1 if self.evaluations > 1 else CALLS_PER_ROUND
        begin = time.perf_counter()
        for _ in range(repeat):
            self.call()
        return 1e6 * (time.perf_counter() - begin) / (repeat * self.evaluations)


def formulations_cost(*, rounds: int = 15, stiffnesses: int = len(STIFFNESSES)) -> StudyReport:
    """Cost of one evaluation by formulation; stiff contact against rigid contact beside it."""
    calls = formulation_calls()
    times = interleaved({one.name: one.microseconds for one in calls}, rounds)
    limits = [(k, tripod(k), slow_gait(k)) for k in STIFFNESSES[:stiffnesses]]
    costs = [(one.name, one.called, Quartiles.of(times[one.name]).text()) for one in calls]
    head = ("force", "torque [N m]", "evaluations", "wall [ms]")
    rows = [
        [f"{k:.0e}", *(cell for x in both for cell in (
            f"{x.force:.1e}", f"{x.torque:.1e}", f"{x.evaluations}", f"{1e3 * x.wall:.1f}"))]
        for k, *both in limits
    ]  # fmt: skip
    return StudyReport(
        "Cost of one evaluation, by formulation",
        [
            "kharagpur, 24 velocities, a random state on five or six feet; medians with quartiles "
            "in brackets; interleaved rounds, one thread (OPENBLAS_NUM_THREADS=1).",
            Table("", ("formulation", "called", "us per evaluation"), costs),
            "Stiff contact against rigid contact: linear springs K and matched dampers in both "
            "directions, feet that never slip. Force: largest difference over the weight; torque: "
            "largest difference.",
            Table("", ("K [N/m]", *(f"tripod: {x}" for x in head),
                       *(f"slow gait: {x}" for x in head)), rows),
        ],
        {
            "microseconds": {name: x.tolist() for name, x in times.items()},
            "limits": [{"stiffness": k, "tripod": vars(stance), "gait": vars(gait)}
                       for k, stance, gait in limits],
        },
    )  # fmt: skip


def formulation_calls() -> list[TimedCall]:
    """Return what is timed."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    q, v, torque = pressed_states(scene, 1)[0]
    model, plant, twin = RigidModel(scene.robot), native_plant(scene), maximal_twin(scene)
    point = RigidModel(hp.load_robot("kharagpur", foot_radius=0.0))
    feet, a = range(6), np.zeros(24)
    return [
        TimedCall("Pinocchio's calls of one core evaluation", "C++, loop in C++",
                  lambda: native.repeat_dynamics(plant, q, v, 1000), 1000),
        TimedCall("core, native.evaluate", "C++, one call from Python",
                  lambda: native.evaluate(plant, q, v, torque)),
        TimedCall("S2 eqs. 1-4, six feet stuck", "Python on Pinocchio",
                  lambda: derivative(model, hp.State(q, v), torque, feet)),
        TimedCall("pin.constraintDynamics, six point feet", "C++, set up in Python each time",
                  lambda: constrained_motion(point, q, v, torque, feet)),
        TimedCall("S2 eq. 5, six feet", "Python on Pinocchio",
                  lambda: plastic_impact(model, q, v, (), feet)),
        TimedCall("S1 maximal coordinates", "Python, numpy",
                  lambda: twin.acceleration((q, v, torque))),
        TimedCall("inverse dynamics, minimum norm", "Python on Pinocchio",
                  lambda: inverse_dynamics(model, q, v, a, feet, MinimumNorm())),
        TimedCall("inverse dynamics, compliant", "Python on Pinocchio",
                  lambda: inverse_dynamics(model, q, v, a, feet, Compliant(servo=240.0))),
        TimedCall("inverse dynamics, least torque", "Python on Pinocchio, nnls",
                  lambda: inverse_dynamics(model, q, v, a, feet, LeastTorque(limited=False))),
    ]  # fmt: skip
