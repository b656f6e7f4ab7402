"""The curves of a joint trajectory between its knots, and their extremes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import JointTrajectory


def trajectory_curve(plan: JointTrajectory) -> Any:
    """Return the joint angles of a cubic or quintic plan as SciPy's piecewise polynomial [rad].

    Raises:
        ParameterError: the plan is of another kind.
    """
    from scipy.interpolate import BPoly, CubicHermiteSpline

    if plan.kind == "cubic":
        return CubicHermiteSpline(plan.time, plan.q, plan.v)
    if plan.kind == "quintic":
        return BPoly(quintic_control_points(plan), plan.time)
    raise ParameterError("JointTrajectory.kind", plan.kind, "cubic or quintic: it has curves")


def quintic_control_points(plan: JointTrajectory) -> Array:
    """Return the Bernstein coefficients of the quintics between the knots. Shape (6, K - 1, n).

    The quintic has position, rate and acceleration of both its ends; it stays between the least
    and the largest of its coefficients [rad].

    Args:
        plan: of kind "quintic".
    """
    assert plan.acceleration is not None  # JointTrajectory has checked it
    h = np.diff(plan.time)[:, None]
    fifth, twentieth = h / 5.0, h**2 / 20.0
    q, v = plan.q, plan.v
    first, last = plan.acceleration[:, 0], plan.acceleration[:, 1]
    return np.stack(
        [
            q[:-1],
            q[:-1] + fifth * v[:-1],
            q[:-1] + 2.0 * fifth * v[:-1] + twentieth * first,
            q[1:] - 2.0 * fifth * v[1:] + twentieth * last,
            q[1:] - fifth * v[1:],
            q[1:],
        ]
    )


def slopes(points: Array, length: Array) -> Array:
    """Return the Bernstein coefficients of derivatives.

    Args:
        points: coefficients of polynomials of degree D. Shape (D + 1, M, n).
        length: of the intervals [s]. Shape (M,).

    Returns:
        Shape (D, M, n).
    """
    return (len(points) - 1) * np.diff(points, axis=0) / length[:, None]


def extremes(points: Array) -> tuple[Array, Array]:
    """Return where in 0..1 a polynomial may have its extremes, ends included, and its values there.

    Args:
        points: its Bernstein coefficients. Shape (D + 1,).

    Returns:
        Shape (E,) each.
    """
    from scipy.interpolate import BPoly, PPoly

    curve = BPoly(points[:, None], [0.0, 1.0])
    roots = PPoly.from_bernstein_basis(curve.derivative()).roots(extrapolate=False)
    at = np.unique(np.concatenate([[0.0, 1.0], roots[np.isfinite(roots)]]))
    return at, np.asarray(curve(at))
