"""The ground under a walk as meshcat commands."""

from __future__ import annotations

import itertools
import math

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.ground_mesh import (
    ground_mesh,
    is_level,
    patch_outlines,
    profile_edges,
    terrain_of,
)
from hexapod_pin.view.meshcat_commands import (
    GROUND_COLOR,
    ROOT,
    Command,
    line_segments,
    mesh_object,
    triangle_mesh,
)
from hexapod_pin.view.robot_shapes import DrawnShape, box
from hexapod_pin.view.view_sizes import Sizes, middle

EDGE_COLOR = (0.42, 0.43, 0.42, 1.0)
PATCH_COLOR = (0.2, 0.4, 0.8, 1.0)


MARGIN = 5.0  # ground around the path, reaches of the robot


def ground_rectangle(
    trace: Trace, sizes: Sizes, margin: tuple[float, float] = (MARGIN, MARGIN)
) -> tuple[Array, Array, float]:
    """Return two corners (2,) of the ground around the path and the spacing of its grid [m].

    Args:
        trace: what is drawn.
        sizes: lengths that fit it.
        margin: around the path along x and y, in reaches of the robot.
    """
    spacing = float(10.0 ** round(math.log10(0.5 * sizes.reach)))
    around = sizes.reach * np.asarray(margin)
    path = middle(trace, np.arange(len(trace.time)))
    low = np.floor((path.min(axis=0) - around) / spacing) * spacing
    high = np.ceil((path.max(axis=0) + around) / spacing) * spacing
    return low, high, spacing


def ground_commands(
    trace: Trace,
    sizes: Sizes,
    *,
    root: str = ROOT,
    margin: tuple[float, float] = (MARGIN, MARGIN),
) -> list[Command]:
    """Return the ground under the whole path: a slab with a grid if level, else its surface."""
    low, high, spacing = ground_rectangle(trace, sizes, margin)
    spacing *= math.ceil(float(np.max(high - low)) / spacing / 500)
    terrain, above = terrain_of(trace), 2e-3 * sizes.reach
    if terrain is None:
        return _slab(low, high, spacing, sizes, root)
    lines = {
        "edges": (profile_edges(terrain, low, high, 0.5 * above), EDGE_COLOR),
        "patches": (patch_outlines(terrain, above), PATCH_COLOR),
    }
    drawn = [
        line_segments(f"{root}/ground/{k}", ends, c) for k, (ends, c) in lines.items() if len(ends)
    ]
    if is_level(terrain):
        return [*_slab(low, high, spacing, sizes, root), *drawn]
    vertices, triangles = ground_mesh(terrain, low, high)
    return [triangle_mesh(f"{root}/ground/surface", vertices, triangles), *drawn]


def _slab(low: Array, high: Array, spacing: float, sizes: Sizes, root: str) -> list[Command]:
    """Return a slab with its top at the ground, and a grid on it."""
    centre, size, thick = 0.5 * (low + high), high - low, 0.1 * sizes.reach
    position = np.array([*centre, sizes.ground - 0.5 * thick])
    slab = DrawnShape(box([*size, thick]), np.eye(3), position, GROUND_COLOR)
    z = sizes.ground + 1e-3 * sizes.reach
    grid = _grid(low, high, spacing, z)
    return [mesh_object(f"{root}/ground/slab", slab), line_segments(f"{root}/ground/grid", grid)]


def _grid(low: Array, high: Array, spacing: float, z: float, *, pieces: int = 12) -> Array:
    """Return the ends (2 K, 3) of grid lines over a rectangle [m].

    Lines come in pieces: one that passes behind the camera may be dropped as a whole.
    """
    x, y = (np.arange(low[k], high[k] + 0.5 * spacing, spacing) for k in range(2))
    cuts = [np.linspace(low[k], high[k], pieces + 1) for k in range(2)]
    along_y = [((a, b, z), (a, c, z)) for a in x for b, c in itertools.pairwise(cuts[1])]
    along_x = [((b, a, z), (c, a, z)) for a in y for b, c in itertools.pairwise(cuts[0])]
    return np.array(along_y + along_x).reshape(-1, 3)
