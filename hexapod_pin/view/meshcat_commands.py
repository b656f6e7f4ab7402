"""meshcat's command language as plain data: objects, meshes, lines, properties."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.view.mesh_store import triangle_geometry
from hexapod_pin.view.robot_shapes import DrawnShape

Command = dict[str, Any]

ROOT = "/meshcat"
DIGITS = 6  # micrometres and microradians
GROUND_COLOR = (0.86, 0.87, 0.85, 1.0)
LINE_COLOR = (0.6, 0.62, 0.6, 1.0)


def set_property(path: str, name: str, value: Any) -> Command:
    """Return the command that sets a property of what stands at a path."""
    return {"type": "set_property", "path": path, "property": name, "value": value}


def mesh_object(path: str, shape: DrawnShape, options: Mapping[str, Any] | None = None) -> Command:
    """Return the command that puts a shape at a path."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = shape.rotation, shape.position
    material = {
        "type": "MeshPhongMaterial",
        "color": _rgb(shape.color),
        "opacity": shape.color[3],
        "transparent": shape.color[3] < 1.0,
        "side": 2,
        **(options or {}),
    }
    return _set_object(path, "Mesh", dict(shape.geometry), material, pose)


def triangle_mesh(path: str, vertices: Array, triangles: npt.NDArray[np.intp]) -> Command:
    """Return the command that draws triangles (F, 3) between vertices (V, 3) [m], facets flat."""
    geometry = triangle_geometry(vertices, triangles)
    color = _rgb(GROUND_COLOR)
    material = {"type": "MeshPhongMaterial", "color": color, "side": 2, "flatShading": True}
    return _set_object(path, "Mesh", geometry, material, np.eye(4))


def line_segments(
    path: str, points: Array, color: tuple[float, float, float, float] = LINE_COLOR
) -> Command:
    """Return the command that draws separate lines between pairs of points (2 K, 3) [m]."""
    data = {"attributes": {"position": _attribute(points)}}
    geometry = {"type": "BufferGeometry", "data": data}
    material = {"type": "LineBasicMaterial", "color": _rgb(color)}
    return _set_object(path, "LineSegments", geometry, material, np.eye(4))


def text_object(path: str, text: str, side: float, rotation: Array) -> Command:
    """Return the command that writes text on a transparent square of `side` [m].

    The square's normal is its z axis, the text's upward direction its y axis; `rotation` (3, 3)
    takes them to the axes of the path.
    """
    pose = np.eye(4)
    pose[:3, :3] = rotation
    texture: Command = {"uuid": f"{path}#texture", "type": "_text", "text": text}
    texture |= {"font_size": 48, "font_face": "sans-serif"}
    material = {"type": "MeshBasicMaterial", "map": texture["uuid"], "transparent": True, "side": 2}
    geometry = {"type": "PlaneGeometry", "width": side, "height": side}
    command = _set_object(path, "Mesh", geometry, material, pose)
    command["object"]["textures"] = [texture]
    return command


def _attribute(points: Array) -> Command:
    """Return points (N, 3) [m] as three.js takes them."""
    array = np.round(points, DIGITS).ravel().tolist()
    return {"itemSize": 3, "type": "Float32Array", "array": array, "normalized": False}


def _set_object(path: str, kind: str, geometry: Command, material: Command, pose: Array) -> Command:
    """Return meshcat's set_object; `pose` (4, 4) of the shape within its path."""
    names = {"geometry": f"{path}#geometry", "material": f"{path}#material"}
    matrix = np.round(pose.T.ravel(), 9).tolist()
    return {
        "type": "set_object",
        "path": path,
        "object": {
            "metadata": {"version": 4.5, "type": "Object"},
            "geometries": [{"uuid": names["geometry"], **geometry}],
            "materials": [{"uuid": names["material"], **material}],
            "object": {"uuid": path, "type": kind, **names, "matrix": matrix},
        },
    }


def _rgb(color: tuple[float, float, float, float]) -> int:
    """Return 0xRRGGBB."""
    red, green, blue = (round(255 * min(max(part, 0.0), 1.0)) for part in color[:3])
    return (red << 16) + (green << 8) + blue
