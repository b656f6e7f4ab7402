"""The set-points of a joint trajectory at any time, with first and second derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.control.joint_trajectory import JointTrajectory


class SetPoints:
    """A trajectory as functions of time, at rest after its last knot.

    Attributes:
        plan: the trajectory.
    """

    def __init__(self, plan: JointTrajectory) -> None:
        """Prepare the cubics between the knots."""
        from scipy.interpolate import CubicHermiteSpline

        self.plan = plan
        curve = None if plan.held else CubicHermiteSpline(plan.time, plan.q, plan.v)
        self._curves = [] if curve is None else [curve.derivative(order) for order in range(3)]

    def __call__(self, time: float) -> tuple[Array, Array, Array]:
        """Return angles [rad], rates [rad/s] and accelerations [rad/s^2], (n,) each.

        The acceleration of a cubic between knots h apart is right to O(h^2) of a smooth path.
        """
        plan = self.plan
        if plan.held or time >= plan.time[-1]:
            knot = int(np.searchsorted(plan.time, time, side="right")) - 1
            at_rest = np.zeros(plan.q.shape[1])
            return plan.q[knot], at_rest, at_rest
        position, rate, acceleration = (curve(time) for curve in self._curves)
        return position, rate, acceleration
