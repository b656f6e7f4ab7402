"""Energy stability margins: how high the centre of mass must rise before the robot tips over.

Messuri & Klein 1985 take the least work m g h over the edges of the support polygon; Hirose et al.
2001 divide it by the weight (normalised energy stability margin, NESM): the least rise h [m].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array
from hexapod_pin.results.gravity_axes import horizontal_axes
from hexapod_pin.results.point_pairs import cross, pairs, sides, standing_points

EDGE_TOLERANCE = 1e-9
"""How far a point may lie outside an edge of the hull, as a share of the extent [-]."""


def edge_rise(first: ArrayLike, second: ArrayLike, com: ArrayLike, up: ArrayLike) -> Array:
    """Return the rise of a centre of mass that turns about an edge until it is above it [m].

    h = |R| (1 - cos theta) cos psi: R from the edge to the centre of mass, at right angles to the
    edge; theta its angle to the vertical plane through the edge; psi the edge's slope. Here cos psi
    is the size of u, the part of `up` at right angles to the edge, and |R| cos theta cos psi is
    R . u. On a level edge at distance d below a centre of mass at height z: sqrt(z^2 + d^2) - z.

    Args:
        first: one end of the edge [m]. Shape (..., 3).
        second: the other end, elsewhere [m]. Shape (..., 3).
        com: centre of mass [m]. Shape (..., 3).
        up: unit vector against gravity. Shape (3,).

    Returns:
        Shape (...), >= 0.
    """
    p, c, z = np.asarray(first), np.asarray(com), np.asarray(up)
    edge = np.asarray(second) - p
    edge = edge / np.linalg.norm(edge, axis=-1, keepdims=True)
    R = c - p - np.sum((c - p) * edge, axis=-1, keepdims=True) * edge
    u = z - np.sum(edge * z, axis=-1, keepdims=True) * edge
    top = np.linalg.norm(R, axis=-1) * np.linalg.norm(u, axis=-1)
    now = np.sum(R * u, axis=-1)
    # top - now without cancellation where now > 0: top^2 - now^2 = |R x u|^2
    gap = np.sum(np.cross(R, u) ** 2, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rise: Array = np.where(now > 0.0, gap / (top + now), top - now)
    return rise


def nesm(
    points: ArrayLike,
    com: ArrayLike,
    grounded: ArrayLike | None = None,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
) -> Array:
    """Return the normalised energy stability margin, the least rise over the polygon's edges [m].

    An edge beyond which the centre of mass already lies counts as minus its rise: the height that
    is lost since it was above the edge. So the margin is 0 on the boundary, and negative outside
    and on two points; on one point it is minus the rise about that point; without any -inf. Where
    points of an edge lie at several heights, each pair of them is an edge.

    Args:
        points: contact points [m]. Shape (..., m, 3).
        com: centre of mass [m]. Shape (..., 3).
        grounded: which points stand; None: all. Shape (..., m).
        gravity: its direction counts. Shape (3,).

    Returns:
        Shape (...).

    Raises:
        ParameterError: shapes do not fit, or there is no gravity.
    """
    axes = horizontal_axes(gravity)
    p, stands = standing_points(points, com, grounded)
    if p.shape[-2] == 0:
        return np.full(stands.shape, -np.inf)
    first, second = pairs(p.shape[-2])
    flat, origin = p @ axes[:2].T, np.zeros(3)
    edge = flat[..., second, :] - flat[..., first, :]
    length = np.linalg.norm(edge, axis=-1)
    slack = EDGE_TOLERANCE * length * length.max(axis=-1, initial=0.0)[..., None]
    side = sides(flat, edge, first)
    own = -cross(edge, flat[..., first, :])
    with np.errstate(divide="ignore", invalid="ignore"):
        rise = edge_rise(p[..., first, :], p[..., second, :], origin, axes[2])
    left = (length > 0.0) & (side.min(axis=-1) >= -slack)
    right = (length > 0.0) & (side.max(axis=-1) <= slack)
    margins = np.minimum(
        np.where(left, np.sign(own) * rise, np.inf), np.where(right, -np.sign(own) * rise, np.inf)
    )
    least = margins.min(axis=-1, initial=np.inf)
    arm = -p[..., 0, :]
    least = np.where(np.isfinite(least), least, arm @ axes[2] - np.linalg.norm(arm, axis=-1))
    return np.where(stands, least, -np.inf)
