"""The set-points of a plan at any time: its cubics, with their first and second derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import JointTrajectory


class SetPoints:
    """A plan as functions of time; before its first and after its last knot it stands still."""

    def __init__(self, plan: JointTrajectory) -> None:
        """Keep the knots."""
        self.plan = plan

    def __call__(self, time: float) -> tuple[Array, Array, Array]:
        """Return angles [rad], rates [rad/s] and accelerations [rad/s^2], (n,) each.

        The acceleration of a cubic between knots h apart is right to O(h^2) of a smooth path.
        """
        plan = self.plan
        still = np.zeros(plan.q.shape[1])
        last = int(np.searchsorted(plan.time, time, side="right")) - 1
        if plan.held or last >= len(plan.time) - 1:
            return plan.q[min(last, len(plan.time) - 1)], still, still
        span = float(plan.time[last + 1] - plan.time[last])
        s = (time - float(plan.time[last])) / span
        q0, q1 = plan.q[last], plan.q[last + 1]
        m0, m1 = span * plan.v[last], span * plan.v[last + 1]
        c2, c3 = 3.0 * (q1 - q0) - 2.0 * m0 - m1, 2.0 * (q0 - q1) + m0 + m1
        position = q0 + s * (m0 + s * (c2 + s * c3))
        rate = (m0 + s * (2.0 * c2 + 3.0 * s * c3)) / span
        return position, rate, (2.0 * c2 + 6.0 * s * c3) / span**2
