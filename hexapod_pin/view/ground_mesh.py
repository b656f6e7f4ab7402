"""The ground as triangles, for whatever draws them: planes, profiles and height fields."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.ground.terrain import (
    AnyTerrain,
    PatchedGround,
    Plane,
    Polyline,
    ShakingGround,
    read_terrain,
)
from hexapod_pin.results.trace import Trace
from hexapod_pin.spec import read_toml

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]

MAX_MESH_CELLS = 250  # of a height field's mesh along one side
PATCH_CELLS = 24  # along a side of a patch's outline


def terrain_of(trace: Trace) -> AnyTerrain | None:
    """Return the ground a trace was made on; None for a trace that does not say.

    Raises:
        ParameterError: the trace's scene is not readable.
    """
    text = str(trace.meta.get("scene", ""))
    data: Any = read_toml(text).get("terrain") if text else None
    return None if not data else read_terrain(data)


def is_level(terrain: AnyTerrain | None) -> bool:
    """Whether a horizontal slab shows this ground."""
    if terrain is None:
        return True
    surface = terrain.surface()
    return isinstance(surface, Plane) and surface.normal[2] == 1.0


def ground_mesh(terrain: AnyTerrain, low: Array, high: Array) -> tuple[Array, npt.NDArray[np.intp]]:
    """Return vertices (V, 3) [m] and triangles (F, 3) of the ground over a rectangle.

    Args:
        terrain: the ground, drawn at rest.
        low: x, y of the rectangle's corner [m].
        high: x, y of the opposite corner [m].
    """
    surface = terrain.surface()
    if isinstance(surface, Polyline):
        return _ribbon(surface, low, high)
    cells = 1 if isinstance(surface, Plane) else MAX_MESH_CELLS
    x, y = (np.linspace(low[k], high[k], cells + 1) for k in range(2))
    grid_x, grid_y = np.meshgrid(x, y)
    vertices = np.stack([grid_x, grid_y, surface.height_at(grid_x, grid_y)], axis=-1)
    return vertices.reshape(-1, 3), _triangles(cells + 1, cells + 1)


def _ribbon(line: Polyline, low: Array, high: Array) -> tuple[Array, npt.NDArray[np.intp]]:
    """Return the mesh of an extruded polyline around a rectangle, risers included."""
    middle, reach = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    along, across = line.along, np.array([-line.along[1], line.along[0]])
    first, last = float(middle @ along) - reach, float(middle @ along) + reach
    inner = [(s, z) for s, z in zip(line.s, line.z, strict=True) if first < s < last]
    ends = [(s, float(line.height_at(*(s * along)))) for s in (first, last)]
    s, z = np.array([ends[0], *inner, ends[1]]).T
    sides = [float(middle @ across) + side * reach for side in (-1.0, 1.0)]
    rows = [np.column_stack([np.outer(s, along) + w * across, z]) for w in sides]
    return np.concatenate(rows), _triangles(2, len(s))


def profile_edges(terrain: AnyTerrain, low: Array, high: Array, above: float) -> Array:
    """Return ends (2 K, 3) [m] of the lines along a profile's edges and corners, a bit above it."""
    surface = terrain.surface()
    if not isinstance(surface, Polyline):
        return np.zeros((0, 3))
    right, left = np.split(_ribbon(surface, low, high)[0], 2)
    lines = np.stack([right, left], axis=1)[1:-1].reshape(-1, 3)
    return np.asarray(lines + (0.0, 0.0, above))


def _triangles(rows: int, columns: int) -> npt.NDArray[np.intp]:
    """Return the triangles (F, 3), seen from above anticlockwise, of a grid of vertices."""
    corner = np.arange(rows * columns).reshape(rows, columns)
    a, b = corner[:-1, :-1].ravel(), corner[:-1, 1:].ravel()
    c, d = corner[1:, :-1].ravel(), corner[1:, 1:].ravel()
    return np.concatenate([np.column_stack([a, b, d]), np.column_stack([a, d, c])])


def patch_outlines(terrain: AnyTerrain, above: float) -> Array:
    """Return ends (2 K, 3) [m] of the lines around a ground's patches, a bit above it."""
    if isinstance(terrain, ShakingGround):
        terrain = terrain.ground
    if not isinstance(terrain, PatchedGround):
        return np.zeros((0, 3))
    t = np.linspace(0.0, 1.0, PATCH_CELLS + 1)
    ends = []
    for patch in terrain.patches:
        (x0, y0), (x1, y1) = patch.low, patch.high
        corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)])
        for start, end in zip(corners[:-1], corners[1:], strict=True):
            x, y = (start + t[:, None] * (end - start)).T
            points = np.column_stack([x, y, terrain.height_at(x, y) + above])
            ends.append(np.stack([points[:-1], points[1:]], axis=1).reshape(-1, 3))
    return np.concatenate(ends)


def shaking(terrain: AnyTerrain | None, time: Array) -> Array | None:
    """Return how far up a shaken ground is [m] at times [s]; None for one at rest."""
    if not isinstance(terrain, ShakingGround) or math.isclose(terrain.amplitude, 0.0):
        return None
    return terrain.lift_at(time)
