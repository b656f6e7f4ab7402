"""A plan sent at ticks: how it converges to the plan as the period of the ticks goes to 0."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.joint_trajectory import JointTrajectory, trajectory_curve
from hexapod_pin.text_table import Table
from studies.study import StudyReport

PERIODS = (0.04, 0.02, 0.01, 0.005, 0.0025, 0.00125)
"""[s]"""

METHODS: dict[str, tuple[dict[str, float], float]] = {
    "extrapolated-euler": ({"accuracy": 1e-6}, 1.0),
    "ndf": ({"accuracy": 1e-6}, 1.0),
    "dop853": ({"accuracy": 1e-6}, 0.2),
    "robust": ({"step": 2.5e-4}, 1.0),
    "implicit-euler": ({"step": 2.5e-4}, 1.0),
    "rk4": ({"step": 2e-5}, 0.2),
}
"""Settings and simulated time [s] of each method."""

SAMPLE = 0.01
"""[s]"""


@dataclass(frozen=True, eq=False)
class PlanAtTicks:
    """Sends the set-points of a plan at ticks, ramped from one to the next.

    Attributes:
        plan: the plan.
        period: of the ticks [s].
    """

    plan: JointTrajectory
    period: float

    @cached_property
    def _angles(self) -> Any:
        return trajectory_curve(self.plan)

    def posture(self, scene: hp.Scene) -> Array:
        """Return the angles at the start [rad]. Shape (n,)."""
        first: Array = self.plan.q[0]
        return first

    def start(self, scene: hp.Scene, batch: int) -> None:
        """Return no state."""

    def update(
        self, time: float, m: hp.feedback.Measurement, state: None
    ) -> tuple[hp.feedback.Command, None]:
        """Return where the plan is at the next tick."""
        row = self._angles(time + self.period)
        return hp.feedback.Command(np.repeat(row[None], len(m.q), axis=0), ramp=True), None


def plan_at_ticks(*, quick: bool = False) -> StudyReport:
    """Difference to the open-loop run, for every method and period; `quick`: 0.1 s of each."""
    robot = hp.load_robot("kharagpur")
    control = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.08, cycle_time=1.2))
    plan, scene = control.plan(robot, 2.0), hp.Scene(robot)
    rows = []
    for method, (how, whole_duration) in METHODS.items():
        duration = 0.1 if quick else whole_duration
        settings: dict[str, Any] = {"method": method, "duration": duration, "sample": SAMPLE, **how}
        whole = hp.simulate(scene, control, **settings).q
        found = [
            float(np.abs(hp.simulate(scene, PlanAtTicks(plan, period), **settings).q - whole).max())
            for period in PERIODS
        ]
        asked = ", ".join(f"{name} {value:g}" for name, value in how.items())
        rows.append([method, asked, f"{duration:g} s", *(f"{error:.1e}" for error in found)])
    head = ["method", "asked", "run", *(f"{1e3 * period:g} ms" for period in PERIODS)]
    return StudyReport(
        "A plan sent at ticks",
        [
            "kharagpur, tetrapod, default contact: a controller returns at every tick where the "
            "plan is at the next one. Largest difference of q to the open-loop run [m or rad] by "
            "period. It falls with the square of the period, down to what the method keeps; "
            "methods of order 1 take the set-points' rate at the end of a step, which a straight "
            "way has not, and stay h kd / kp times the joints' acceleration away.",
            Table("", head, rows),
        ],
    )
