"""The set-points of a joint trajectory at any time, with first and second derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.control.joint_trajectory import CURVED, trajectory_curve

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.control.joint_trajectory import JointTrajectory


class SetPoints:
    """A trajectory as functions of time, at rest after its last knot.

    Attributes:
        plan: the trajectory.
    """

    def __init__(self, plan: JointTrajectory) -> None:
        """Prepare the curves between the knots."""
        self.plan = plan
        self._curves = []
        if plan.kind in CURVED:
            curve = trajectory_curve(plan)
            self._curves = [curve.derivative(order) for order in range(3)]

    def __call__(self, time: float) -> tuple[Array, Array, Array]:
        """Return angles [rad], rates [rad/s] and accelerations [rad/s^2], (n,) each.

        The rates of a linear plan are the set-points of the drives, and the acceleration is 0.
        The acceleration of a cubic between knots h apart is right to O(h^2) of a smooth path; a
        quintic has that of its knots, at a knot the one of the interval that begins there.
        """
        plan = self.plan
        if plan.held or time >= plan.time[-1]:
            knot = int(np.searchsorted(plan.time, time, side="right")) - 1
            at_rest = np.zeros(plan.q.shape[1])
            return plan.q[knot], at_rest, at_rest
        if plan.kind == "linear":
            knot = int(np.searchsorted(plan.time, time, side="right")) - 1
            share = (time - plan.time[knot]) / (plan.time[knot + 1] - plan.time[knot])
            travel = plan.q[knot + 1] - plan.q[knot]
            return plan.q[knot] + share * travel, plan.v[knot], np.zeros(plan.q.shape[1])
        position, rate, acceleration = (curve(time) for curve in self._curves)
        return position, rate, acceleration
