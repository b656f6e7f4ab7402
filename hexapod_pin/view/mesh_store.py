"""The meshes of one picture: each stored once, all together within a budget."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from hexapod_pin.robot.reading.mesh_file import Mesh
from hexapod_pin.view.mesh_decimation import creased, decimated, merged, shared_limit
from hexapod_pin.view.triangle_geometry import triangle_geometry

TRIANGLE_BYTES = 64
"""Most that a triangle takes of an HTML file: three corners of its own in float32, three indices,
base64."""
MESH_BUDGET = 75_000
"""Triangles of all meshes of a picture: at most 4.8 MB of an HTML file."""


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
