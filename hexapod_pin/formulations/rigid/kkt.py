"""The saddle-point system of contacts, solved whatever the rank of its rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array

RANK = 1e-9
"""Singular values of L^-1 J^T below this share of the largest count as zero."""

CLEAR = 1e-6
"""With a last pivot above this share of the first, QR alone settles that the rank is full."""

FREE = 1e-7
"""A multiplier with a larger part than this in the null space is not unique."""


@dataclass(frozen=True)
class Ranked:
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


def solve_ranked(mass: Array, right: Array, rows: Array, target: Array) -> Ranked:
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

    whiten = np.linalg.inv(np.linalg.cholesky(mass))  # L^-1
    across, free, count = whiten @ rows.T, whiten @ right, len(rows)
    wanted = target - across.T @ free
    if 0 < count <= len(mass):
        base, upper, order = qr(across, mode="economic", pivoting=True)
        pivots = np.abs(np.diag(upper))
        if pivots[-1] > CLEAR * pivots[0]:
            part = np.linalg.solve(upper.T, wanted[order])
            f = np.empty(count)
            f[order] = np.linalg.solve(upper, part)
            x = whiten.T @ (free + base @ part)
            return Ranked(x, f, count, np.ones(count, dtype=bool), rows @ x - target)
    return _deficient(whiten, free, wanted, rows, target)


def _deficient(whiten: Array, free: Array, wanted: Array, rows: Array, target: Array) -> Ranked:
    """Return the solution by SVD, for rows that depend on each other, or none at all."""
    left, size, right = np.linalg.svd(whiten @ rows.T)
    rank = int((size > RANK * size.max(initial=0.0)).sum())
    part = right[:rank] @ wanted / size[:rank]
    x = whiten.T @ (free + left[:, :rank] @ part)
    f = right[:rank].T @ (part / size[:rank])
    unique = np.asarray(np.linalg.norm(right[rank:], axis=0) < FREE)
    return Ranked(x, f, rank, unique, rows @ x - target)
