"""Meshes of a playback are stored once and decimated to a limit."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.robot.reading.mesh_file import Mesh

MESH_BUDGET = 75_000
"""Triangles of all meshes of a page."""


class MeshStore:
    """Meshes by content; the largest are decimated until all of them keep the budget."""

    def __init__(self, budget: int = MESH_BUDGET) -> None:
        """Hold meshes for one picture of at most `budget` triangles."""
        self.budget = budget
        self._meshes: dict[str, tuple[Any, Any]] = {}
        self._drawn: dict[str, dict[str, Any]] = {}

    def add(self, mesh: Mesh) -> str:
        """Take a mesh, and return the key of its geometry; all are added before any is drawn."""
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
        content = hashlib.sha256(vertices.astype(np.float32).tobytes())
        content.update(faces.tobytes())
        key = content.hexdigest()
        if key not in self._meshes:
            self._meshes[key] = merged(vertices, faces)
        return key

    @cached_property
    def limit(self) -> int:
        """Triangles allowed to each mesh."""
        return shared_limit([len(faces) for _, faces in self._meshes.values()], self.budget)

    def geometry(self, key: str) -> Mapping[str, Any]:
        """Return a mesh as three.js takes it, in arrays that all users of the key share."""
        if key not in self._drawn:
            vertices, faces = creased(*decimated(*self._meshes[key], self.limit))
            self._drawn[key] = triangle_geometry(vertices, faces)
        return self._drawn[key]

    @property
    def note(self) -> str:
        """What was reduced; empty if nothing."""
        large = [len(f) for _, f in self._meshes.values() if len(f) > self.limit]
        if not large:
            return ""
        return (
            f"{len(large)} meshes of {sum(large)} triangles are drawn with at most {self.limit} "
            "each, to keep the file small"
        )


# Meshes small enough for a picture: vertices merged, triangles reduced, creases left sharp.

Faces = npt.NDArray[np.int64]

CREASE_ANGLE = 0.6
"""Angle between neighbouring triangles above which their edge is drawn sharp [rad]."""
MERGE_LENGTH = 1e-6
"""Distance within which vertices are one, over the mesh's diagonal."""
AGGRESSIVENESS = 5.0
"""Of the reduction, 0 to 10: lower is slower and keeps the shape better."""
FINEST_GRID = 256
"""Cells along a mesh's longest side where vertices must be merged to keep a budget."""


def shared_limit(counts: Sequence[int], budget: int) -> int:
    """Return the triangles allowed to each mesh so that all of them keep a budget.

    Meshes below the limit stay as they are; the larger ones share what is left equally.

    Args:
        counts: triangles of every mesh.
        budget: triangles of all meshes together.
    """
    left = budget
    for k, count in enumerate(sorted(counts)):
        equal = left // (len(counts) - k)
        if count > equal:
            return equal
        left -= count
    return max(counts, default=0)


def merged(vertices: Array, faces: Faces) -> tuple[Array, Faces]:
    """Return a mesh without repeated vertices, vertices without use, and triangles without area.

    Args:
        vertices: (V, 3) [m].
        faces: (F, 3) rows of `vertices`.
    """
    span = float(np.linalg.norm(np.ptp(vertices, axis=0))) or 1.0
    cells = np.round((vertices - vertices.min(axis=0)) / (MERGE_LENGTH * span)).astype(np.int64)
    _, first, same = np.unique(
        cells @ np.array([1, 1 << 21, 1 << 42]), return_index=True, return_inverse=True
    )
    faces = same.reshape(-1)[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    used, renumbered = np.unique(faces, return_inverse=True)
    return vertices[first[used]], renumbered.reshape(-1, 3)


def decimated(vertices: Array, faces: Faces, limit: int) -> tuple[Array, Faces]:
    """Return a merged mesh with at most `limit` triangles; one that has no more stays as it is.

    Edges collapse where that changes the surface least (quadric error, Garland & Heckbert 1997).
    Where this does not suffice, as for loose triangles, vertices are merged within ever coarser
    cells of a grid.
    """
    if len(faces) <= limit:
        return vertices, faces
    import fast_simplification

    points, triangles = fast_simplification.simplify(
        np.ascontiguousarray(vertices, dtype=np.float32),
        np.ascontiguousarray(faces, dtype=np.int32),
        target_count=limit,
        agg=AGGRESSIVENESS,
    )
    found = merged(np.asarray(points, dtype=float), np.asarray(triangles, dtype=np.int64))
    cells = FINEST_GRID
    while len(found[1]) > limit:
        found = _clustered(*found, cells)
        cells //= 2
    return found


def _clustered(vertices: Array, faces: Faces, cells: int) -> tuple[Array, Faces]:
    """Return the mesh with all vertices of a grid's cell at their mean."""
    low = vertices.min(axis=0)
    size = max(float(np.ptp(vertices, axis=0).max()), 1e-12) / max(cells, 1)
    keys = np.floor((vertices - low) / size).astype(np.int64) @ np.array([1, 1 << 20, 1 << 40])
    _, same, count = np.unique(keys, return_inverse=True, return_counts=True)
    same, mean = same.reshape(-1), np.zeros((len(count), 3))
    np.add.at(mean, same, vertices)
    mean /= count[:, None]
    faces = same[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    _, once = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return mean, faces[np.sort(once)]


def creased(vertices: Array, faces: Faces) -> tuple[Array, Faces]:
    """Return the mesh with vertices doubled along sharp edges.

    Normals that are means over a vertex's triangles are then smooth on curved surfaces and differ
    across creases.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    one, other = _neighbours(faces)
    normal = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    smooth = np.einsum("ij,ij->i", normal[one], normal[other]) > np.cos(CREASE_ANGLE)
    links = (np.ones(int(smooth.sum())), (one[smooth], other[smooth]))
    _, part = connected_components(coo_array(links, shape=(len(faces),) * 2), directed=False)
    keys = faces * np.int64(len(faces) + 1) + part[:, None]
    _, first, same = np.unique(keys.ravel(), return_index=True, return_inverse=True)
    return vertices[faces.ravel()[first]], same.reshape(-1, 3)


def _neighbours(faces: Faces) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the pairs of triangles (E,), (E,) that share an edge."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    key = edges[:, 0] * np.int64(faces.max(initial=0) + 1) + edges[:, 1]
    order = np.argsort(key, kind="stable")
    equal = np.flatnonzero(key[order][1:] == key[order][:-1])
    return order[equal] % len(faces), order[equal + 1] % len(faces)


# Triangles in the data format of three.js.


def triangle_geometry(vertices: Array, triangles: npt.NDArray[Any]) -> dict[str, Any]:
    """Return triangles as three.js takes them, numbers in arrays: of 2 bytes an index if they fit.

    Args:
        vertices: (V, 3) [m].
        triangles: (F, 3) rows of `vertices`.
    """
    short = len(vertices) < 1 << 16
    position = {
        "itemSize": 3,
        "type": "Float32Array",
        "array": vertices.astype(np.float32).ravel(),
        "normalized": False,
    }
    index = {
        "itemSize": 1,
        "type": "Uint16Array" if short else "Uint32Array",
        "array": triangles.astype(np.uint16 if short else np.uint32).ravel(),
        "normalized": False,
    }
    data = {"attributes": {"position": position}, "index": index}
    return {"type": "BufferGeometry", "data": data}
