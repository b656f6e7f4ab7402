"""Small least-squares problems under linear equations and inequalities, solved exactly.

A strictly convex quadratic program with linear constraints is a least-distance problem, and that
is one call of non-negative least squares (Lawson & Hanson 1974, ch. 23): finite, no tolerance to
tune (`scipy.optimize.nnls`). The active constraints are then solved as equations, which takes the
answer to rounding.
"""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import HexapodError
from hexapod_pin.formulations.truncated_svd import pseudo_inverse

EQUATION_ROUNDING = 1e-10
"""Share of the largest bound by which a point without a choice may break an inequality [-]."""

INFEASIBLE_RESIDUAL = 1e-10
"""Residual of the non-negative problem, at most 1, below which there is no solution [-]."""


class InfeasibleError(HexapodError):
    """No values meet all equations and inequalities."""


def least_squares(a: Array, b: Array, rows: Array, target: Array, g: Array, h: Array) -> Array:
    """Return the x of least |a x - b| with rows x = target and g x >= h.

    Args:
        a: of full column rank on the null space of `rows`. Shape (p, n).
        b: shape (p,).
        rows: shape (m, n); any rank, but the equations must not contradict each other.
        target: shape (m,).
        g: shape (c, n).
        h: shape (c,).

    Raises:
        InfeasibleError: no x meets them.
    """
    inverse, null = pseudo_inverse(rows)
    x0 = inverse @ target
    if not null.shape[1]:
        return _checked(x0, g, h)
    q, r = np.linalg.qr(a @ null)
    back = null @ np.linalg.inv(r)  # x = x0 + back (y + q^T (b - a x0)), |a x - b| = |y| + rest
    middle = x0 + back @ (q.T @ (b - a @ x0))
    bound, normal = h - g @ middle, g @ back
    return middle + back @ _least_distance(normal, bound)


def _checked(x: Array, g: Array, h: Array) -> Array:
    if (g @ x < h - EQUATION_ROUNDING * max(1.0, float(np.abs(h).max(initial=0.0)))).any():
        raise InfeasibleError("the equations leave no choice, and break an inequality")
    return x


def _least_distance(normal: Array, bound: Array) -> Array:
    """Return the shortest y with normal y >= bound."""
    from scipy.optimize import nnls

    columns = normal.shape[1]
    size = np.linalg.norm(normal, axis=1)
    scaled = normal / size[:, None]
    reach = bound / size
    longest = float(reach.max(initial=0.0))
    if longest <= 0.0:
        return np.zeros(columns)
    system = np.vstack([scaled.T, reach / longest])
    wanted = np.append(np.zeros(columns), 1.0)
    weight, rest = nnls(system, wanted)
    if rest < INFEASIBLE_RESIDUAL:
        raise InfeasibleError("no forces meet the balance, the friction cones and the limits")
    active = weight > 0.0
    inverse, _ = pseudo_inverse(scaled[active])
    found: Array = inverse @ reach[active]
    return found
