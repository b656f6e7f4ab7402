"""Singular values of a matrix of any rank: range, null space and pseudo-inverse."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array

RELATIVE_RANK_TOLERANCE = 1e-10
"""Singular values below this share of the largest count as zero [-]."""


def truncated_svd(
    matrix: Array, tolerance: float = RELATIVE_RANK_TOLERANCE
) -> tuple[Array, Array, Array, Array]:
    """Return U (m, r), sizes (r,), V' (r, n) and a null-space basis (n, n - r) of (m, n)."""
    left, size, right = np.linalg.svd(matrix, full_matrices=True)
    rank = int((size > tolerance * size.max(initial=0.0)).sum())
    return left[:, :rank], size[:rank], right[:rank], right[rank:].T


def pseudo_inverse(matrix: Array) -> tuple[Array, Array]:
    """Return pseudo-inverse (n, m) and orthonormal null-space basis (n, n - rank) of (m, n)."""
    left, size, right, null = truncated_svd(matrix)
    return right.T @ (left / size).T, null
