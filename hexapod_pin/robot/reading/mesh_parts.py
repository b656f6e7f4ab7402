"""The parts of a mesh file: placed vertices, triangles, mean colour.

trimesh (with pycollada) reads all but binary STL, the usual kind, which needs no library to load.
"""

from __future__ import annotations

import io
import logging
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.errors import MeshError
from hexapod_pin.robot.reading.mesh_color import mean_color
from hexapod_pin.robot.reading.mesh_part import MeshPart
from hexapod_pin.robot.reading.stl_binary import binary_stl
from hexapod_pin.user_file import read_bytes, reason_of

MAX_MESH_BYTES = 300_000_000
"""Largest mesh file that is read [bytes]."""

_UNIT = re.compile(rb"""<unit\b[^>]*?\bmeter\s*=\s*["']([^"']*)["']""")
_ENTITY = re.compile(rb"<!(?:DOCTYPE|ENTITY)", re.IGNORECASE)


def parts_of(path: Path) -> tuple[list[MeshPart], float]:
    """Return the parts of a file, placed as its nodes say, and its unit [m].

    Raises:
        MeshError: the file cannot be read.
    """
    data = _bytes(path)
    extension = path.suffix.casefold()
    if extension == ".stl" and (part := binary_stl(data)) is not None:
        return [part], 1.0
    unit = _collada_unit(path, data) if extension == ".dae" else 1.0
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            parts = _placed(_loaded(path, data))
    except MemoryError as error:
        raise MeshError(str(path), "does not fit into memory; decimate the mesh") from error
    except Exception as error:  # what a mesh reader raises is not ours to know
        reason = f"{type(error).__name__}: {error}".strip()[:300]
        raise MeshError(
            str(path), f"cannot be read as {extension[1:].upper()} ({reason})"
        ) from error
    return parts, unit


def _loaded(path: Path, data: bytes) -> Any:
    """Load a file's content by trimesh: no vertices merged, nothing printed on the terminal.

    Other files that it names, as of materials, are read from its folder alone, by the same rule.
    """
    import trimesh
    from trimesh.resolvers import FilePathResolver

    class Beside(FilePathResolver):  # type: ignore[misc]
        def get(self, name: str) -> bytes:
            return read_bytes(self.absolute(name), MAX_MESH_BYTES)

    logger = logging.getLogger("trimesh")
    if not logger.handlers:
        logger.addHandler(logging.NullHandler())
    return trimesh.load_scene(
        io.BytesIO(data), file_type=path.suffix.casefold()[1:], resolver=Beside(str(path)),
        process=False,
    )  # fmt: skip


def _placed(scene: Any) -> list[MeshPart]:
    """Return every triangle mesh of a scene in the scene's axes."""
    parts = []
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        geometry = scene.geometry[name]
        faces = getattr(geometry, "faces", None)
        if faces is None or not len(faces):
            continue
        transform = np.asarray(transform, dtype=np.float64)
        vertices = np.asarray(geometry.vertices) @ transform[:3, :3].T + transform[:3, 3]
        faces = np.asarray(faces, dtype=np.int64)
        if np.linalg.det(transform[:3, :3]) < 0.0:
            faces = faces[:, ::-1]
        parts.append(MeshPart(vertices, faces, mean_color(geometry)))
    return parts


def _bytes(path: Path) -> bytes:
    try:
        return read_bytes(path, MAX_MESH_BYTES)
    except (OSError, ValueError) as error:
        raise MeshError(str(path), f"cannot be opened ({reason_of(error)})") from error


def _collada_unit(path: Path, data: bytes) -> float:
    """Return the <unit> of a COLLADA file [m]; refuses entities, which could grow without bound."""
    if _ENTITY.search(data.replace(b"\0", b"")):  # in UTF-16 and UTF-32 too
        raise MeshError(str(path), "has a <!DOCTYPE ...>: remove it (entities are not expanded)")
    found = _UNIT.search(data)
    try:
        unit = float(found[1]) if found else 1.0
    except ValueError:
        unit = np.nan
    if not 0.0 < unit < np.inf:
        raise MeshError(str(path), "its <unit meter=...> must be a number above 0")
    return unit
