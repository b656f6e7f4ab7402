"""Whether a quintic joint trajectory keeps the joints' ranges and velocity limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.trajectory_curve import extremes, quintic_control_points, slopes
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.leg_geometry import ANGLE_TOLERANCE

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import JointTrajectory
    from hexapod_pin.robot.robot import Robot

RATE_TOLERANCE = 1e-9
"""Share of a velocity limit by which a rate may exceed it."""


def refuse_beyond_limits(robot: Robot, plan: JointTrajectory, owner: str) -> None:
    """Check the exact extremes of angles and rates of a plan of kind "quintic".

    The Bernstein coefficients enclose the polynomials; extremes are searched for only in intervals
    in which they do not decide.

    Args:
        robot: whose limits hold.
        plan: the trajectory.
        owner: what the error names first.

    Raises:
        ParameterError: naming the first joint beyond a limit, the time and the value.
    """
    angle = quintic_control_points(plan)
    rate = slopes(angle, np.diff(plan.time))
    bounds = (robot.lower - ANGLE_TOLERANCE, robot.upper + ANGLE_TOLERANCE)
    found = _first_beyond(plan.time, angle, *bounds)
    if found is not None:
        joint, when, value = found
        raise ParameterError(
            f"{owner}: angle of {robot.joint_names[joint]} at t = {when:.4g} s", value,
            f"{robot.lower[joint]:.4f} to {robot.upper[joint]:.4f} rad",
        )  # fmt: skip
    limit = robot.velocity * (1.0 + RATE_TOLERANCE)
    found = _first_beyond(plan.time, rate, -limit, limit)
    if found is not None:
        joint, when, value = found
        raise ParameterError(
            f"{owner}: rate of {robot.joint_names[joint]} at t = {when:.4g} s", value,
            f"-{robot.velocity[joint]:g} to {robot.velocity[joint]:g} rad/s",
        )  # fmt: skip


def _first_beyond(
    time: Array, points: Array, lower: Array, upper: Array
) -> tuple[int, float, float] | None:
    """Return joint, time [s] and value of the farthest point beyond bounds in the first interval.

    Args:
        time: knots [s]. Shape (K,).
        points: Bernstein coefficients. Shape (D + 1, K - 1, n).
        lower: least values. Shape (n,).
        upper: largest values. Shape (n,).
    """
    doubtful = (points.max(axis=0) > upper) | (points.min(axis=0) < lower)
    for interval, joint in np.argwhere(doubtful):
        at, value = extremes(points[:, interval, joint])
        beyond = np.maximum(lower[joint] - value, value - upper[joint])
        worst = int(np.argmax(beyond))
        if beyond[worst] > 0.0:
            when = time[interval] + at[worst] * (time[interval + 1] - time[interval])
            return int(joint), float(when), float(value[worst])
    return None
