"""Reading a mesh file: STL, DAE, OBJ, PLY, GLB, as one mesh in metres with one colour.

As RViz and Gazebo do, a COLLADA file's <unit> is applied and its <up_axis> is not: the axes of the
file are those of the link. URDFs are drawn to look right there.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array, protect
from hexapod_pin.errors import MeshError, ParameterError
from hexapod_pin.robot.reading.mesh_cache import MeshCache
from hexapod_pin.robot.reading.mesh_part import MeshPart
from hexapod_pin.robot.reading.mesh_parts import parts_of
from hexapod_pin.robot.reading.tail_search import MESH_EXTENSIONS
from hexapod_pin.user_file import reason_of

MAX_MESH_FACES = 5_000_000
"""Most triangles of a mesh."""
SMALLEST_MESH = 1e-9
"""Least size of a mesh, scaled: the longest edge of the box around it [m]."""
LARGEST_MESH = 1e6
"""Largest coordinate of a mesh, scaled [m]."""
DENORMAL = 1e-100
"""Coordinates below are taken as 0 [m]: their products are no normal numbers."""

Color = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in the frame of the shape that names the file.

    Attributes:
        vertices: (N, 3) [m].
        faces: (M, 3) rows of `vertices`, anticlockwise seen from outside.
        color: red, green, blue, alpha from 0 to 1: the mean over the surface of the file's
            materials and textures; None where the file gives none.
        note: the unit that the file states, where it is not the metre; else empty.
    """

    vertices: Array
    faces: NDArray[np.int32]
    color: Color | None = None
    note: str = ""

    @property
    def bounds(self) -> Array:
        """(2, 3) lowest and highest coordinates [m]."""
        return np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @cached_property
    def hull_vertices(self) -> Array:
        """(K, 3) corners of the convex hull [m]; all different vertices of a flat mesh.

        Qhull crashes on coordinates whose cubes overflow: `read_mesh` lets none of them pass.
        """
        from scipy.spatial import ConvexHull, QhullError

        points = np.unique(self.vertices, axis=0)
        try:
            return np.asarray(points[ConvexHull(points).vertices])
        except (QhullError, ValueError):
            return points


_CACHE = MeshCache[Mesh](max_bytes=256_000_000)


def read_mesh(path: str | Path, scale: Sequence[float] = (1.0, 1.0, 1.0)) -> Mesh:
    """Read a mesh; the same file is read once while it does not change.

    Args:
        path: an STL, DAE, OBJ, PLY, GLB or GLTF file.
        scale: of x, y and z, as the URDF gives it; negative factors mirror, and the faces are
            turned so that they still look outwards.

    Raises:
        MeshError: the file is missing, too large, not readable or empty, or the scaled mesh is
            not finite, smaller than `SMALLEST_MESH` or reaches beyond `LARGEST_MESH`.
        ParameterError: a scale is zero or not finite, or they are not three.
    """
    factors = _checked_scale(scale)
    try:
        state = os.stat(path)
    except (OSError, ValueError) as error:
        raise MeshError(str(path), f"cannot be opened ({reason_of(error)})") from error
    key = (os.path.abspath(path), state.st_mtime_ns, state.st_size, factors)
    return _CACHE.get(key, lambda: _read(Path(path), factors), _size)


def _read(path: Path, factors: tuple[float, ...]) -> Mesh:
    """Read, join, scale and check a mesh."""
    if path.suffix.casefold() not in MESH_EXTENSIONS:
        known = ", ".join(MESH_EXTENSIONS)
        raise MeshError(str(path), f"is not a mesh that can be read ({known}); export it as STL")
    parts, unit = parts_of(path)
    faces_number = sum(len(part.faces) for part in parts)
    if not faces_number:
        raise MeshError(str(path), "has no triangles")
    if faces_number > MAX_MESH_FACES:
        raise MeshError(
            str(path), f"has {faces_number} triangles: at most {MAX_MESH_FACES}; decimate the mesh"
        )
    vertices, faces = _joined(parts)
    with np.errstate(over="ignore", invalid="ignore"):  # judged by what comes out
        vertices *= np.array(factors) * unit
    vertices[np.abs(vertices) < DENORMAL] = 0.0
    _check(path, vertices, faces)
    if np.prod(np.sign(factors)) < 0.0:
        faces = faces[:, ::-1]
    note = "" if unit == 1.0 else f"the file's unit is {unit:g} m"
    mesh = Mesh(vertices, np.ascontiguousarray(faces, np.int32), _mean_color(parts), note)
    protect(mesh)
    return mesh


def _joined(parts: Sequence[MeshPart]) -> tuple[Array, NDArray[np.int64]]:
    """Return the vertices and faces of all parts."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    vertices = np.concatenate([part.vertices for part in parts])
    return np.array(vertices, dtype=np.float64), np.concatenate(faces)


def _check(path: Path, vertices: Array, faces: NDArray[np.int64]) -> None:
    """Refuse absurd coordinates, meshes of no size, and faces of vertices that do not exist."""
    way_out = "correct the scale in the URDF, or export the mesh in metres"
    wrong = np.flatnonzero(~(np.abs(vertices) <= LARGEST_MESH).all(axis=1))
    if len(wrong):
        value = ", ".join(f"{number:g}" for number in vertices[wrong[0]])
        allowed = f"must be finite and at most {LARGEST_MESH:g} m from the origin along each axis"
        raise MeshError(str(path), f"vertex {wrong[0]} is ({value}) m: {allowed}; {way_out}")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise MeshError(str(path), "a triangle names a vertex that does not exist; export it again")
    size = float(np.ptp(vertices, axis=0).max())
    if size < SMALLEST_MESH:
        allowed = f"must be from {SMALLEST_MESH:g} to {LARGEST_MESH:g} m"
        raise MeshError(str(path), f"is {size:g} m large: {allowed}; {way_out}")


def _mean_color(parts: Sequence[MeshPart]) -> Color | None:
    """Return the mean colour over the area of the parts that have one."""
    colored = [part for part in parts if part.color is not None]
    if not colored:
        return None
    areas = np.array([part.area for part in colored])
    total = areas.sum()
    weights = areas / total if 0.0 < total < np.inf else np.full(len(areas), 1.0 / len(areas))
    red, green, blue, alpha = np.clip(weights @ np.array([p.color for p in colored]), 0.0, 1.0)
    return float(red), float(green), float(blue), float(alpha)


def _checked_scale(scale: Sequence[float]) -> tuple[float, ...]:
    """Return the scale as three numbers; refuses zero and what is not finite."""
    factors = tuple(float(factor) for factor in scale)
    if len(factors) != 3 or not all(np.isfinite(factors)) or 0.0 in factors:
        raise ParameterError("mesh scale", factors, "three finite factors other than 0")
    return factors


def _size(mesh: Mesh) -> int:
    return int(mesh.vertices.nbytes + mesh.faces.nbytes)
