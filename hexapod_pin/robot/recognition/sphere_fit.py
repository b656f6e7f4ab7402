"""Spheres that come as triangles: a tessellated foot gives back its centre and radius."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array

ROUND = 0.01
"""Vertices lie on a sphere when their distances from its centre differ by less than this share."""

FLAT = 0.75
"""No face of a tessellated sphere is nearer to its centre than this share of the radius; those
of a box (at most 0.58) and of a cylinder (at most 0.71) are, although their vertices lie on one."""

FEWEST = 12
"""Vertices of the coarsest sphere that is taken for one: an icosahedron."""


class Ball(NamedTuple):
    """A sphere: centre (3,) [m] and radius [m]."""

    centre: Array
    radius: float


def mesh_parts(vertices: Array, faces: Array) -> Iterator[Ball | Array]:
    """Return the connected parts of a mesh: spheres as `Ball`, the others as vertices (N, 3).

    Args:
        vertices: [m]. Shape (N, 3).
        faces: three vertices each. Shape (M, 3).
    """
    points, merged = np.unique(vertices, axis=0, return_inverse=True)
    triangles = merged.reshape(-1)[faces] if len(faces) else np.zeros((0, 3), dtype=int)
    labels = _connected(len(points), triangles)
    for label in np.unique(labels):
        part = labels == label
        chosen = triangles[part[triangles[:, 0]]] if len(triangles) else triangles
        ball = _closed_ball(points, part, chosen)
        yield points[part] if ball is None else ball


def fitted_ball(points: Array) -> Ball | None:
    """Return the sphere through points (N, 3) by least squares; None where they lie on none.

    |p|^2 = 2 c . p + (r^2 - c^2) is linear in the centre and in the last term: exact where the
    points are (Coope, J. Optim. Theory Appl. 76, 1993).
    """
    if len(points) < 4:
        return None
    middle = points.mean(axis=0)
    size = float(np.abs(points - middle).max())
    if size == 0:
        return None
    scaled = (points - middle) / size
    matrix = np.column_stack([2 * scaled, np.ones(len(scaled))])
    solution, _, rank, _ = np.linalg.lstsq(matrix, (scaled**2).sum(axis=1), rcond=1e-9)
    square = float(solution[3] + solution[:3] @ solution[:3])
    if rank < 4 or square <= 0:
        return None
    centre, radius = middle + size * solution[:3], size * square**0.5
    off = np.abs(np.linalg.norm(points - centre, axis=1) - radius).max()
    return Ball(centre, radius) if off <= ROUND * radius else None


def _closed_ball(points: Array, part: Array, triangles: Array) -> Ball | None:
    """Return the sphere that a connected part is, None where it is none."""
    if part.sum() < FEWEST:
        return None
    ball = fitted_ball(points[part])
    if ball is None:
        return None
    a, b, c = (points[triangles[:, k]] - ball.centre for k in range(3))
    normals = np.cross(b - a, c - a)
    sizes = np.linalg.norm(normals, axis=1)
    sound = sizes > 1e-9 * ball.radius**2
    if not sound.any():
        return None
    height = np.abs((normals[sound] * a[sound]).sum(axis=1)) / sizes[sound]
    return ball if height.min() >= FLAT * ball.radius else None


def _connected(count: int, triangles: Array) -> Array:
    """Return the number of the connected part that each vertex belongs to."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if not len(triangles):
        return np.zeros(count, dtype=int)
    edges = np.vstack([triangles[:, :2], triangles[:, 1:]])
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    labels: Array = connected_components(graph, directed=False)[1]
    return labels
