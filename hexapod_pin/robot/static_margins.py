"""Margins of a support polygon: how far a projected centre of mass is from its edges.

Distances are found over all pairs of points: lines and segments that do not bound the hull cannot
be nearer than those that do, so that no hull has to be built and all samples are treated at once.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError

INSIDE_TOLERANCE = 1e-12
"""Depth below which a point counts as on the boundary, as a share of the points' extent [-]."""


@checked
def support_polygon(points: ArrayLike) -> Array:
    """Return the corners of the convex hull of points, counter-clockwise; collinear ones left out.

    Args:
        points: shape (m, 2) [m].

    Returns:
        Shape (k, 2), k <= m; one or two points where there is no area.
    """
    rows = np.unique(np.asarray(points, dtype=float).reshape(-1, 2), axis=0)
    if len(rows) < 3:
        return rows
    lower, upper = _chain(rows), _chain(rows[::-1])
    return np.array([*lower[:-1], *upper[:-1]])


@checked
def static_margin(points: ArrayLike, com: ArrayLike, grounded: ArrayLike | None = None) -> Array:
    """Return the distance of a projected centre of mass to the polygon's edges, < 0 outside [m].

    Outside it is minus the distance to the nearest point of the polygon. Two points (or points on a
    line) are a polygon without an inside: the margin is minus the distance to the segment, 0 on it;
    one point: minus the distance to it; none: -inf.

    Args:
        points: contact points, projected [m]. Shape (..., m, 2).
        com: the projection of the centre of mass, or of any other point [m]. Shape (..., 2).
        grounded: which points stand; None: all. Shape (..., m).

    Returns:
        Shape (...).
    """
    p, stands = standing_points(points, com, grounded)
    if p.shape[-2] == 0:
        return np.full(stands.shape, -np.inf)
    first, second = pairs(p.shape[-2])
    edge = p[..., second, :] - p[..., first, :]
    length = np.linalg.norm(edge, axis=-1)
    side = sides(p, edge, first)
    own = -cross(edge, p[..., first, :])
    reach = np.minimum(side.max(axis=-1) - own, own - side.min(axis=-1))
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(length > 0.0, reach / length, np.inf).min(axis=-1, initial=np.inf)
    extent = length.max(axis=-1, initial=0.0)
    inside = np.isfinite(depth) & (depth > INSIDE_TOLERANCE * extent)
    margin: Array = np.where(inside, depth, -_distance_to_segments(p, edge, first))
    return np.where(stands, margin, -np.inf)


@checked
def longitudinal_margins(
    points: ArrayLike, com: ArrayLike, heading: ArrayLike, grounded: ArrayLike | None = None
) -> tuple[Array, Array]:
    """Return how far the polygon's boundary is ahead of and behind the centre of mass [m].

    The smaller one is McGhee and Frank's longitudinal stability margin. Of a centre of mass outside
    one is negative; both are -inf where the line along the heading misses the polygon.

    Args:
        points: contact points, projected [m]. Shape (..., m, 2).
        com: the projection of the centre of mass [m]. Shape (..., 2).
        heading: direction of travel, unit vector. Shape (..., 2) or (2,).
        grounded: which points stand; None: all. Shape (..., m).

    Returns:
        Ahead and behind. Shape (...) each.
    """
    p, stands = standing_points(points, com, grounded)
    if p.shape[-2] == 0:
        nothing = np.full(stands.shape, -np.inf)
        return nothing, nothing.copy()
    along = np.asarray(heading, dtype=float)[..., None, :]
    forward, left = np.sum(along * p, axis=-1), cross(along, p)
    first, second = (np.append(k, np.arange(p.shape[-2])) for k in pairs(p.shape[-2]))
    l1, l2, s1, s2 = left[..., first], left[..., second], forward[..., first], forward[..., second]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(l1 == l2, 0.0, l1 / (l1 - l2))
    place, crosses = s1 + share * (s2 - s1), l1 * l2 <= 0.0
    meets = np.where(l1 == l2, l1 == 0.0, crosses)
    ahead = np.where(meets, place, -np.inf).max(axis=-1)
    behind = np.where(meets, -place, -np.inf).max(axis=-1)
    return np.where(stands, ahead, -np.inf), np.where(stands, behind, -np.inf)


def _distance_to_segments(p: Array, edge: Array, first: Indices) -> Array:
    """Return the origin's distance to the nearest segment between two points, or lone point."""
    to_points = np.linalg.norm(p, axis=-1).min(axis=-1)
    away = -p[..., first, :]
    square = np.sum(edge * edge, axis=-1)
    share = np.sum(away * edge, axis=-1) / np.where(square > 0.0, square, 1.0)
    share = np.clip(share, 0.0, 1.0)
    off = np.linalg.norm(away - share[..., None] * edge, axis=-1)
    found: Array = np.minimum(to_points, off.min(axis=-1, initial=np.inf))
    return found


def _chain(rows: Array) -> list[Array]:
    """Return one half of a hull of sorted points (Andrew's monotone chain)."""
    chain: list[Array] = []
    for point in rows:
        while len(chain) > 1 and cross(chain[-1] - chain[-2], point - chain[-2]) <= 0.0:
            chain.pop()
        chain.append(point)
    return chain


# Points that stand, and the pairs of them: what margins in a support polygon are found from.

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
