"""A mesh file is read as one mesh in metres with one colour, and cached.

The formats are STL, DAE, OBJ, PLY and GLB.

As RViz and Gazebo do, a COLLADA file's <unit> is applied and its <up_axis> is not: the axes of the
file are those of the link. URDFs are drawn to look right there.
"""

from __future__ import annotations

import io
import logging
import os
import re
import warnings
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array, protect
from hexapod_pin.errors import MeshError, ParameterError
from hexapod_pin.robot.reading.folder_index import MESH_EXTENSIONS
from hexapod_pin.user_file import read_bytes, reason_of

# A cache that holds a bounded amount of meshes, the least lately used going first.

Value = TypeVar("Value")


class MeshCache(Generic[Value]):
    """Values by key, up to a number of bytes; safe between threads."""

    def __init__(self, max_bytes: int) -> None:
        """Hold at most so many bytes."""
        self.max_bytes = max_bytes
        self._held: OrderedDict[Hashable, tuple[Value, int]] = OrderedDict()
        self._bytes = 0
        self._lock = Lock()

    @property
    def bytes(self) -> int:
        """Bytes held now."""
        return self._bytes

    def get(self, key: Hashable, make: Callable[[], Value], size: Callable[[Value], int]) -> Value:
        """Return the value of a key, made where it is not stored; an exception is not stored."""
        with self._lock:
            if key in self._held:
                self._held.move_to_end(key)
                return self._held[key][0]
        value = make()
        number = size(value)
        with self._lock:
            if key not in self._held and number <= self.max_bytes:
                self._held[key] = value, number
                self._bytes += number
            while self._bytes > self.max_bytes:
                self._bytes -= self._held.popitem(last=False)[1][1]
        return value


# Reading a mesh file: STL, DAE, OBJ, PLY, GLB, as one mesh in metres with one colour.

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
    """Refuse absurd coordinates, meshes of no size, and faces of vertices that do not exist.

    Qhull crashes on coordinates whose cubes overflow.
    """
    remedy = "correct the scale in the URDF, or export the mesh in metres"
    wrong = np.flatnonzero(~(np.abs(vertices) <= LARGEST_MESH).all(axis=1))
    if len(wrong):
        value = ", ".join(f"{number:g}" for number in vertices[wrong[0]])
        allowed = f"must be finite and at most {LARGEST_MESH:g} m from the origin along each axis"
        raise MeshError(str(path), f"vertex {wrong[0]} is ({value}) m: {allowed}; {remedy}")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise MeshError(str(path), "a triangle names a vertex that does not exist; export it again")
    size = float(np.ptp(vertices, axis=0).max())
    if size < SMALLEST_MESH:
        allowed = f"must be from {SMALLEST_MESH:g} to {LARGEST_MESH:g} m"
        raise MeshError(str(path), f"is {size:g} m large: {allowed}; {remedy}")


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


# The mean colour of one geometry that trimesh has read.

Rgba = tuple[float, float, float, float]


def mean_color(geometry: Any) -> Rgba | None:
    """Return the mean colour over a geometry's faces or texture, from 0 to 1; None without any."""
    visual = geometry.visual
    if getattr(visual, "material", None) is not None:
        return _of_material(visual.material)
    if getattr(visual, "kind", None) in ("face", "vertex"):
        areas = np.asarray(geometry.area_faces, dtype=np.float64)
        colors = np.asarray(visual.face_colors, dtype=np.float64) / 255.0
        weights = areas if areas.sum() > 0.0 else np.ones(len(areas))
        return _rgba(weights @ colors / weights.sum())
    return None


def _of_material(material: Any) -> Rgba | None:
    """Return the colour of a material: its texture's mean, or its diffuse or base colour."""
    factor = _factor(material)
    for name in ("baseColorTexture", "image"):
        image = getattr(material, name, None)
        if image is not None:
            pixels = np.asarray(image.convert("RGBA"), dtype=np.float64) / 255.0
            mean = pixels.reshape(-1, 4).mean(axis=0)
            return _rgba(
                mean * factor if name == "baseColorTexture" and factor is not None else mean
            )
    return None if factor is None else _rgba(factor)


def _factor(material: Any) -> Array | None:
    """Return a material's plain colour; None where it states none."""
    for name in ("baseColorFactor", "diffuse"):
        value = getattr(material, name, None)
        if value is not None:
            color = np.asarray(value)
            color = color / 255.0 if color.dtype.kind in "ui" else color.astype(np.float64)
            return np.append(color[:3], color[3] if len(color) > 3 else 1.0)
    return None


def _rgba(color: Array) -> Rgba:
    red, green, blue, alpha = (float(value) for value in color)
    return red, green, blue, alpha


# A part of a mesh file: triangles with one mean colour.


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


# The parts of a mesh file: placed vertices, triangles, mean colour.
#
# trimesh (with pycollada) reads all but binary STL, the usual kind, which needs no library to load.

MAX_MESH_BYTES = 300_000_000
"""Largest mesh file that is read [bytes]."""

_UNIT = re.compile(rb"""<unit\b[^>]*?\bmeter\s*=\s*["']([^"']*)["']""")
_ENTITY = re.compile(rb"<!(?:DOCTYPE|ENTITY)", re.IGNORECASE)


def parts_of(path: Path) -> tuple[list[MeshPart], float]:
    """Return the parts of a file, placed by its nodes, and its unit [m].

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


# Binary STL: triangles, and the colour that two dialects keep in the bytes behind each.
#
# VisCAM and SolidView: bit 15 set, then red, green, blue of 5 bits each, blue in the lowest.
# Materialise Magics: "COLOR=" with red, green, blue and opacity in the header is the body's; a
# triangle with bit 15 clear has its own, red in the lowest bits. Programs that write such a header
# and nothing but zeros behind the triangles mean the body's colour, and often put a space where the
# opacity stands: it is not read.

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("bits", "<u2")])
_HEADER = 84


def binary_stl(data: bytes) -> MeshPart | None:
    """Return the triangles of a binary STL; None where the length is not that of one."""
    if len(data) < _HEADER:
        return None
    count = int.from_bytes(data[80:_HEADER], "little")
    if len(data) != _HEADER + count * _TRIANGLE.itemsize:
        return None
    triangles = np.frombuffer(data, _TRIANGLE, offset=_HEADER)
    vertices = triangles["corners"].reshape(-1, 3).astype(np.float64)
    faces = np.arange(len(vertices), dtype=np.int64).reshape(-1, 3)
    color = _color(data[:80], triangles["bits"], triangle_areas(vertices, faces))
    return MeshPart(vertices, faces, color)


def _color(header: bytes, bits: NDArray[np.uint16], areas: Array) -> Rgba | None:
    """Return the mean colour over the area; None where the file gives none."""
    channels = np.stack([bits & 31, (bits >> 5) & 31, (bits >> 10) & 31], axis=1) / 31.0
    marked = (bits & 0x8000) != 0
    start = header.find(b"COLOR=")
    if 0 <= start <= len(header) - 10:
        body = np.frombuffer(header, np.uint8, 3, start + 6) / 255.0
        colors = np.where((marked | (not bits.any()))[:, None], body, channels)
    elif marked.any():
        colors, areas = channels[:, ::-1][marked], areas[marked]
    else:
        return None
    weights = areas if 0.0 < areas.sum() < np.inf else np.ones(len(areas))
    red, green, blue = (float(value) for value in weights @ colors / weights.sum())
    return red, green, blue, 1.0
