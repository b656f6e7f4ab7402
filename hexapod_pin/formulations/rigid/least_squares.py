"""Small least-squares problems under linear equations and inequalities, solved exactly.

A strictly convex quadratic program with linear constraints is a least-distance problem, and that
is one call of non-negative least squares (Lawson & Hanson 1974, ch. 23): finite, no tolerance to
tune, and `scipy.optimize.nnls` is kept by others. The active constraints are then solved as
equations, which takes the answer to rounding.
"""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import HexapodError

RANK = 1e-10
"""Singular values below this share of the largest count as zero."""

INFEASIBLE = 1e-10
"""Residual of the non-negative problem (it is 1 where nothing is in the way) that means none."""


class InfeasibleError(HexapodError):
    """No set of values meets all equations and inequalities."""


def null_space(rows: Array) -> tuple[Array, Array]:
    """Return pseudo-inverse (n, m) and orthonormal null-space basis (n, n - rank) of (m, n)."""
    left, size, across = np.linalg.svd(rows, full_matrices=True)
    rank = int((size > RANK * size[:1].max(initial=0.0)).sum())
    inverse = across[:rank].T @ (left[:, :rank] / size[:rank]).T
    return inverse, across[rank:].T


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
    inverse, null = null_space(rows)
    x0 = inverse @ target
    if not null.shape[1]:
        return _checked(x0, g, h)
    q, r = np.linalg.qr(a @ null)
    back = null @ np.linalg.inv(r)  # x = x0 + back (y + q^T (b - a x0)), |a x - b| = |y| + rest
    middle = x0 + back @ (q.T @ (b - a @ x0))
    bound, normal = h - g @ middle, g @ back
    return middle + back @ _least_distance(normal, bound)


def _checked(x: Array, g: Array, h: Array) -> Array:
    if (g @ x < h - RANK * max(1.0, float(np.abs(h).max(initial=0.0)))).any():
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
    if rest < INFEASIBLE:
        raise InfeasibleError("no forces meet the balance, the friction cones and the limits")
    active = weight > 0.0
    inverse, _ = null_space(scaled[active])
    found: Array = inverse @ reach[active]
    return found
