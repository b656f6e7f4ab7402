"""A part of a mesh file: triangles with one mean colour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.robot.reading.mesh_color import Rgba


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Triangles: vertices (N, 3) in the file's unit, faces (M, 3), mean colour or None."""

    vertices: Array
    faces: NDArray[np.int64]
    color: Rgba | None

    @property
    def area(self) -> float:
        """Area of the surface [square of the file's unit]."""
        return float(triangle_areas(self.vertices, self.faces).sum())


def triangle_areas(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Return the area of every triangle, (M,) in the square of the vertices' unit."""
    corners = vertices[faces]
    with np.errstate(all="ignore"):  # coordinates are judged when the parts are joined
        crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return np.asarray(0.5 * np.sqrt((crossed**2).sum(axis=1)))
