"""The saddle-point (KKT) system of S2 appendix eqs. 4 and 5, for rows J of any rank."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.truncated_svd import truncated_svd

RELATIVE_RANK_TOLERANCE = 1e-9
"""Singular values of L^-1 J^T below this share of the largest count as zero [-]."""

FULL_RANK_PIVOT_RATIO = 1e-6
"""Last pivot over the first above which pivoted QR alone settles that the rank is full [-]."""

UNIQUE_NULL_SPACE_PART = 1e-7
"""A multiplier with a larger part than this in the null space is not unique [-]."""


@dataclass(frozen=True)
class KktSolution:
    """Solution of [M -J^T; J 0] [x; f] = [r; t] with m rows.

    Attributes:
        x: acceleration or velocity change. Shape (n,). Unique, whatever the rank.
        f: the multipliers of smallest norm. Shape (m,).
        rank: of J.
        unique: which multipliers every solution shares. Shape (m,).
        residual: J x - t; not 0 where the rows contradict each other, then of least norm. (m,).
    """

    x: Array
    f: Array
    rank: int
    unique: NDArray[np.bool_]
    residual: Array


def solve_kkt(mass: Array, right: Array, rows: Array, target: Array) -> KktSolution:
    """Solve [M -J^T; J 0] [x; f] = [r; t] by QR or SVD of A = L^-1 J^T, M = L L^T.

    The motion of the system does not depend on how redundant rows share their load; f is the
    share of smallest norm. Rows that cannot all be met are met in the least-squares sense.
    QR with pivoting serves rows that are clearly independent, SVD all others.

    Args:
        mass: M, positive definite. Shape (n, n).
        right: r. Shape (n,).
        rows: J. Shape (m, n).
        target: t. Shape (m,).
    """
    from scipy.linalg import qr

    inverse_root = np.linalg.inv(np.linalg.cholesky(mass))  # L^-1
    a, free, count = inverse_root @ rows.T, inverse_root @ right, len(rows)
    needed = target - a.T @ free
    if 0 < count <= len(mass):
        base, upper, order = qr(a, mode="economic", pivoting=True)
        pivots = np.abs(np.diag(upper))
        if pivots[-1] > FULL_RANK_PIVOT_RATIO * pivots[0]:
            part = np.linalg.solve(upper.T, needed[order])
            f = np.empty(count)
            f[order] = np.linalg.solve(upper, part)
            x = inverse_root.T @ (free + base @ part)
            return KktSolution(x, f, count, np.ones(count, dtype=bool), rows @ x - target)
    left, size, across, null = truncated_svd(a, RELATIVE_RANK_TOLERANCE)
    part = across @ needed / size
    x = inverse_root.T @ (free + left @ part)
    unique = np.asarray(np.linalg.norm(null, axis=1) < UNIQUE_NULL_SPACE_PART)
    return KktSolution(x, across.T @ (part / size), len(size), unique, rows @ x - target)
