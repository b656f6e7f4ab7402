"""The ground is drawn from heights, in sizes that a view takes from its trace."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import (
    AnyTerrain,
    PatchedGround,
    Plane,
    Polyline,
    ShakingGround,
)
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.rotations import trunk_yaw, yawed
from hexapod_pin.view.sample_block import SampleBlock

HEIGHT_DIGITS = 1e-4
"""Resolution of the heights of a ground [m]."""


MARGIN = 5.0  # ground around the path, reaches of the robot


def ground_rectangle(trace: Trace, sizes: Sizes) -> tuple[Array, Array, float]:
    """Return two corners (2,) of the ground around the path and the spacing of its grid [m].

    Args:
        trace: what is drawn.
        sizes: lengths that fit it.
    """
    spacing = float(10.0 ** round(math.log10(0.5 * sizes.reach)))
    around = sizes.reach * MARGIN
    path = middle(trace, np.arange(len(trace.time)))
    low = np.floor((path.min(axis=0) - around) / spacing) * spacing
    high = np.ceil((path.max(axis=0) + around) / spacing) * spacing
    return low, high, spacing


def ground_data(trace: Trace, sizes: Sizes, block: SampleBlock) -> dict[str, Any]:
    """Return the ground under the whole path as the page draws it.

    A grid of heights over a rectangle, of which the indices of triangles follow, or corners and
    triangles of a profile; lines along its edges and around patches; and how a shaken ground moves.

    Args:
        trace: what is drawn.
        sizes: lengths that fit it.
        block: takes the heights.
    """
    low, high, spacing = ground_rectangle(trace, sizes)
    terrain, above = terrain_of(trace), 2e-3 * sizes.reach
    found: dict[str, Any] = {
        "low": low.tolist(), "high": high.tolist(), "spacing": spacing, "level": is_level(terrain)
    }  # fmt: skip
    if terrain is None or is_level(terrain):
        heights = np.full((2, 2), sizes.ground)
    elif isinstance(line := terrain.surface(), Polyline):
        vertices, triangles = _ribbon(line, low, high)
        found["mesh"] = (
            block.add(vertices, 1e-5, order=1), block.add(triangles.ravel(), 1.0, order=1)
        )  # fmt: skip
        found["edges"] = _lines(profile_edges(terrain, low, high, above))
        heights = None
    else:
        heights = ground_heights(terrain, low, high)
    if heights is not None:
        found["rows"], found["heights"] = len(heights), block.add(heights, HEIGHT_DIGITS)
    if terrain is not None and len(outlines := patch_outlines(terrain, above)):
        found["patches"] = _lines(outlines)
    lift = shaking(terrain, trace.time)
    if lift is not None:
        found["lift"] = block.add(lift, 1e-5)
    return found


def _lines(ends: Array) -> list[float]:
    rounded: list[float] = np.round(ends, 5).ravel().tolist()
    return rounded


# The ground as triangles, for whatever draws them: planes, profiles and height fields.

MAX_MESH_CELLS = 250  # of a height field's mesh along one side
PATCH_CELLS = 24  # along a side of a patch's outline


def terrain_of(trace: Trace) -> AnyTerrain | None:
    """Return the ground a trace was made on; None for a trace without a scene.

    Raises:
        ParameterError: the trace's scene is not readable.
    """
    scene = trace.run.scene
    return None if scene is None else scene.terrain


def is_level(terrain: AnyTerrain | None) -> bool:
    """Whether a horizontal slab shows this ground."""
    if terrain is None:
        return True
    surface = terrain.surface()
    return isinstance(surface, Plane) and surface.normal[2] == 1.0


def ground_heights(terrain: AnyTerrain, low: Array, high: Array) -> Array:
    """Return heights (R, R) [m] over a rectangle: rows along y, columns along x, ends included."""
    surface = terrain.surface()
    cells = 1 if isinstance(surface, Plane) else MAX_MESH_CELLS
    x, y = (np.linspace(low[k], high[k], cells + 1) for k in range(2))
    return np.asarray(surface.height_at(*np.meshgrid(x, y)))


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


# Sizes of what is drawn, from the trace: reach of the robot, ground level, scale of forces.

ASIDE = 0.3
"""Distance of the trunk's origin from the feet's mean, over the farthest foot's, that is too far
for a picture around it."""


FORCE_SCALES = (1e-9, 1e3, "m/N")
"""Lengths of arrows per force that a picture is made for; a walk's are near 0.01 m/N."""


def require_in(name: str, value: Any, allowed: tuple[float, float, str]) -> None:
    """Refuse a number outside a range, given as its ends and its unit.

    Raises:
        ParameterError: names the number and the range.
    """
    least, most, unit = allowed
    number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not (number and least <= value <= most):
        raise ParameterError(name, value, f"from {least:g} to {most:g} {unit}")


@dataclass(frozen=True)
class Sizes:
    """Lengths that fit the picture to the robot."""

    reach: float  # middle to farthest foot at the start, horizontally [m]
    ground: float  # height of the ground's top [m]
    force_scale: float  # arrow length per force [m/N]

    @classmethod
    def of(cls, trace: Trace, force_scale: float | None) -> Sizes:
        """Measure a trace; by default an arrow of the robot's weight is 1.5 reaches long."""
        radii = trace.run.robot.radii(len(trace.foot_names))
        ground, reach = 0.0, 0.3
        if trace.foot_names and "contacts" in trace.recorded:
            away = trace.foot_position[0, :, :2] - middle(trace, np.zeros(1, dtype=np.intp))[0]
            reach = max(0.05, float(np.max(np.linalg.norm(away, axis=1))))
            ground = float(np.mean(trace.foot_position[0, :, 2] - radii - trace.foot_gap[0]))
        if force_scale is None:
            force_scale = 1.5 * reach / _weight(trace)
        else:
            require_in("force_scale", force_scale, FORCE_SCALES)
        return cls(reach, ground, force_scale)


def middle(trace: Trace, index: npt.NDArray[np.intp]) -> Array:
    """Return x and y of the robot's middle at some samples (K, 2) [m].

    It is the trunk's origin; where that lies well aside of the feet, as in drawings exported with
    a frame far from the body, the point of the trunk that was between the feet at the start.
    """
    places = trace.q[index, :2]
    if not trace.foot_names or "contacts" not in trace.recorded:
        return np.asarray(places)
    feet = trace.foot_position[0, :, :2]
    aside = feet.mean(axis=0) - trace.q[0, :2]
    span = float(np.max(np.linalg.norm(feet - feet.mean(axis=0), axis=1)))
    if not np.linalg.norm(aside) > ASIDE * span:
        return np.asarray(places)
    return np.asarray(places + yawed(aside, trunk_yaw(trace.q[index]) - trunk_yaw(trace.q[:1])))


def eye_level(trace: Trace) -> float:
    """Return the height that a picture looks at [m]: the trunk's origin at the start.

    Where that is below the feet, or as high as 1.5 times their distance from the middle, 0.4
    times this distance above the feet.
    """
    height = float(trace.q[0, 2])
    if not trace.foot_names or "contacts" not in trace.recorded:
        return height
    feet, reach = float(np.mean(trace.foot_position[0, :, 2])), Sizes.of(trace, 1.0).reach
    return height if 0.0 <= height - feet <= 1.5 * reach else feet + 0.4 * reach


def _weight(trace: Trace) -> float:
    """Return the robot's weight, or where it has none the largest foot force, or 1 [N]."""
    weight = (trace.run.robot.total_mass or 0.0) * float(np.linalg.norm(trace.run.gravity))
    if weight or "contacts" not in trace.recorded:
        return weight or 1.0
    return float(np.max(np.linalg.norm(trace.foot_force, axis=-1), initial=0.0)) or 1.0
