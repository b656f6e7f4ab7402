"""Points that stand, and the pairs of them: what margins in a support polygon are found from."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError

Indices = NDArray[np.intp]


def standing_points(
    points: ArrayLike, com: ArrayLike, grounded: ArrayLike | None
) -> tuple[Array, NDArray[np.bool_]]:
    """Return points relative to the centre of mass, all of which stand, and whether any does.

    Those that do not stand are put on one that does. A point twice does not change the hull, so
    that samples with other feet down can go together.
    """
    p, c = np.asarray(points, dtype=float), np.asarray(com, dtype=float)
    if p.ndim < 2 or p.shape[-1] != c.shape[-1]:
        raise ParameterError("points", p.shape, f"of shape (..., m, {c.shape[-1]})")
    relative: Array = p - c[..., None, :]
    if grounded is None:
        return relative, np.full(relative.shape[:-2], p.shape[-2] > 0, dtype=bool)
    down = np.asarray(grounded, dtype=bool)
    if down.shape != p.shape[:-1]:
        raise ParameterError("grounded", down.shape, f"of shape {p.shape[:-1]}")
    used = down.reshape(-1, down.shape[-1]).any(axis=0)
    relative, down = relative[..., used, :], down[..., used]
    stands: NDArray[np.bool_] = np.asarray(down.any(axis=-1), dtype=bool)
    if not used.any():
        return relative, stands
    one = np.take_along_axis(relative, down.argmax(axis=-1)[..., None, None], axis=-2)
    return np.where(down[..., None], relative, one), stands


@lru_cache(maxsize=32)
def pairs(count: int) -> tuple[Indices, Indices]:
    """Return the indices of all pairs of `count` points, first < second."""
    first, second = np.triu_indices(count, 1)
    return first, second


def sides(p: Array, edge: Array, first: Indices) -> Array:
    """Return edge x (point - edge's first point): > 0 to the left. (..., E, 2) -> (..., E, m)."""
    start = cross(edge, p[..., first, :])
    found: Array = (
        edge[..., :1] * p[..., None, :, 1] - edge[..., 1:] * p[..., None, :, 0] - start[..., None]
    )
    return found


def cross(a: Array, b: Array) -> Array:
    """Return a x b of plane vectors. (..., 2) -> (...)."""
    found: Array = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return found
