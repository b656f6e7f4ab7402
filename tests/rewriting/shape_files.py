"""Primitive shapes as mesh files, vertices on their surfaces: binary STL and OBJ."""

from __future__ import annotations

import struct

import numpy as np

from hexapod_pin.arrays import Array
from rewriting.parts import RobotParts

SIDES = 24
"""Corners of a round shape's outline."""

RINGS = 12
"""Rings of a sphere between its poles."""

Mesh = tuple[Array, Array]
"""Vertices (N, 3) [m] and triangles (M, 3) of their numbers."""


def to_meshes(robot: RobotParts, kind: str, folder: str) -> dict[str, bytes]:
    """Replace all primitives by mesh files of a kind in `SHAPES`; return path -> content."""
    form, scale = kind.split(maxsplit=1)[0], 1e-3 if kind.endswith("mm") else 1.0
    files: dict[str, bytes] = {}
    for link in robot.links:
        for number, shape in enumerate(link.shapes):
            vertices, triangles = mesh_of(shape.kind, shape.size)
            path = f"{folder}/{link.name}_{number}.{form}"
            write = stl_bytes if form == "stl" else _obj
            files[path] = write(vertices / scale, triangles)
            shape.kind, shape.size = "mesh", {"filename": path}
            if scale != 1.0:
                shape.size["scale"] = f"{scale} {scale} {scale}"
    return files


def mesh_of(kind: str, size: dict[str, str]) -> Mesh:
    """Return the mesh of a box, cylinder or sphere with a URDF's attributes."""
    if kind == "box":
        half = 0.5 * np.array([float(value) for value in size["size"].split()])
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        return corners * half, _halves(quads)
    radius = float(size["radius"])
    if kind == "cylinder":
        half_length = 0.5 * float(size["length"])
        return _rings([(0.0, -half_length), (radius, -half_length), (radius, half_length)],
                      (0.0, half_length))  # fmt: skip
    angles = np.linspace(0.0, np.pi, RINGS + 2)
    outline = [(radius * np.sin(a), -radius * np.cos(a)) for a in angles]
    return _rings([(0.0, -radius), *outline[1:-1]], (0.0, radius))


def _rings(outline: list[tuple[float, float]], top: tuple[float, float]) -> Mesh:
    """Return a body of revolution from a pole over rings (radius, z) to the top pole."""
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    rings = [np.array([[0.0, 0.0, outline[0][1]]])]
    for radius, z in outline[1:]:
        rings.append(np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn + z], axis=1))
    rings.append(np.array([[0.0, 0.0, top[1]]]))
    last, quads, triangles = 1 + SIDES * (len(outline) - 1), [], []
    for k in range(SIDES):
        after = (k + 1) % SIDES
        triangles.append((0, 1 + after, 1 + k))
        triangles.append((last, last - SIDES + k, last - SIDES + after))
        for ring in range(len(outline) - 2):
            low, high = 1 + ring * SIDES, 1 + (ring + 1) * SIDES
            quads.append((low + k, low + after, high + after, high + k))
    faces = np.vstack([np.array(triangles), _halves(quads)]) if quads else np.array(triangles)
    return np.vstack(rings), faces


def _halves(quads: list[tuple[int, int, int, int]]) -> Array:
    return np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def stl_bytes(vertices: Array, triangles: Array) -> bytes:
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    rows = np.concatenate([normals[:, None], corners], axis=1).astype("<f4")
    body = b"".join(row.tobytes() + b"\0\0" for row in rows)
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + body


def _obj(vertices: Array, triangles: Array) -> bytes:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles.tolist()]
    return ("\n".join(lines) + "\n").encode()
