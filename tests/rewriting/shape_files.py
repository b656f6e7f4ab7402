"""Primitive shapes as mesh files, vertices on their surfaces: binary STL and OBJ."""

from __future__ import annotations

import numpy as np
import trimesh

from hexapod_pin.arrays import Array
from rewriting.parts import RobotParts

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
    if kind == "box":
        made = trimesh.creation.box([float(value) for value in size["size"].split()])
    elif kind == "cylinder":
        made = trimesh.creation.cylinder(float(size["radius"]), float(size["length"]), sections=24)
    else:
        made = trimesh.creation.uv_sphere(float(size["radius"]), count=[14, 24])
    return np.array(made.vertices), np.array(made.faces)


def stl_bytes(vertices: Array, triangles: Array) -> bytes:
    data: bytes = trimesh.Trimesh(vertices, triangles, process=False).export(file_type="stl")
    return data


def _obj(vertices: Array, triangles: Array) -> bytes:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles.tolist()]
    return ("\n".join(lines) + "\n").encode()
