"""The meshes that a URDF draws its links with: where they are fixed, and their colours."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import MeshError, ParameterError
from hexapod_pin.robot.description.urdf_file import origin, triple
from hexapod_pin.robot.description.urdf_inertia import rotation
from hexapod_pin.robot.reading.mesh_file import Mesh, read_mesh
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.user_file import read_bytes

Color = tuple[float, float, float, float]

MESH_COLOR: Color = (0.62, 0.66, 0.71, 1.0)
"""Of a mesh for which neither the URDF nor its file gives a colour."""
BRIGHTEST_BYTE = 255.0

TEXTURE_BYTES = 100_000_000
"""Largest image that is read [bytes]."""


@dataclass(frozen=True, eq=False)
class MeshVisual:
    """A mesh fixed to a link.

    Attributes:
        link: name of the link.
        mesh: scaled, in the shape's frame.
        rotation: (3, 3) attitude in the link's frame.
        position: (3,) [m] in the link's frame.
        color: red, green, blue, opacity; 0 to 1.
    """

    link: str
    mesh: Mesh
    rotation: Array
    position: Array
    color: Color


def mesh_visuals(urdf: str, finder: ResourceFinder | None) -> tuple[list[MeshVisual], list[str]]:
    """Return the meshes that can be drawn, and a sentence on each that cannot.

    Collision meshes are taken for a robot without any visual shape, and for a link of which no
    visual shape can be drawn.

    Args:
        urdf: text of the file.
        finder: looks for the files; None where it is not known where the URDF was.
    """
    root = ElementTree.fromstring(urdf)
    colors = _named_colors(root, finder)
    kind = "visual" if root.find("link/visual") is not None else "collision"
    found, notes = [], dict[str, None]()
    for link in root.findall("link"):
        drawn, reasons = _meshes_of(link, kind, colors, finder)
        if reasons and len(link.findall(kind)) == len(reasons) and kind == "visual":
            drawn, _ = _meshes_of(link, "collision", colors, finder)
            if drawn:
                reasons = [f"{reason} What the link collides with is drawn." for reason in reasons]
        found += drawn
        notes |= dict.fromkeys(reasons)
    return found, list(notes)


def _meshes_of(
    link: ElementTree.Element,
    kind: str,
    colors: dict[str, Color],
    finder: ResourceFinder | None,
) -> tuple[list[MeshVisual], list[str]]:
    """Return a link's visual or collision meshes, and why others of them cannot be drawn."""
    found, reasons = [], []
    for element in link.findall(kind):
        if element.find("geometry/mesh") is not None:
            try:
                found.append(_visual(link.get("name", ""), element, colors, finder))
            except (MeshError, ParameterError, ValueError) as error:
                reasons.append(str(error))
    return found, reasons


def _visual(
    link: str,
    element: ElementTree.Element,
    colors: dict[str, Color],
    finder: ResourceFinder | None,
) -> MeshVisual:
    """Return one mesh; an error says why it cannot be drawn."""
    shape: Any = element.find("geometry/mesh")
    name = shape.get("filename") or ""
    if finder is None:
        raise ValueError(f"{name}: it is not known in which folder the URDF was")
    path = finder.find(name)
    if path is None:
        raise ValueError(finder.why(name))
    scale = triple(shape.get("scale")) if shape.get("scale") else (1.0, 1.0, 1.0)
    mesh = read_mesh(path, scale)
    xyz, rpy = origin(element)
    if not np.isfinite((*xyz, *rpy)).all():
        raise ValueError(f"{name}: its origin is not finite")
    material = element.find("material")
    own = None if material is None else _color(material, finder)
    named = None if material is None else colors.get(material.get("name") or "")
    color = own or named or mesh.color or MESH_COLOR
    return MeshVisual(link, mesh, rotation(rpy), np.array(xyz), color)


def _named_colors(root: ElementTree.Element, finder: ResourceFinder | None) -> dict[str, Color]:
    """Return the colours that materials anywhere in the file define; the first of a name counts."""
    colors: dict[str, Color] = {}
    for material in (*root.findall("material"), *root.findall("link/visual/material")):
        color, name = _color(material, finder), material.get("name")
        if name and color is not None:
            colors.setdefault(name, color)
    return colors


def _color(material: ElementTree.Element, finder: ResourceFinder | None) -> Color | None:
    """Return the colour that a material states, or its texture's mean; None without either."""
    texture, element = material.find("texture"), material.find("color")
    if texture is not None and finder is not None:
        mean = _texture_mean(finder, texture.get("filename") or "")
        if mean is not None:
            return mean
    try:
        parts = (
            [float(x) for x in (element.get("rgba") or "").split()] if element is not None else []
        )
    except ValueError:
        return None
    if len(parts) not in (3, 4) or not np.isfinite(parts).all() or min(parts) < 0.0:
        return None
    if max(parts[:3]) > 1.0:
        parts[:3] = [part / BRIGHTEST_BYTE for part in parts[:3]]
    alpha = parts[3] if len(parts) == 4 else 1.0
    return parts[0], parts[1], parts[2], alpha / BRIGHTEST_BYTE if alpha > 1.0 else alpha


def _texture_mean(finder: ResourceFinder, name: str) -> Color | None:
    """Return the mean colour of an image; None where it is not found or not readable."""
    path = finder.find(name)
    if path is None:
        return None
    from PIL import Image

    try:
        data = read_bytes(path, TEXTURE_BYTES)
        with Image.open(io.BytesIO(data)) as image:
            pixels = np.asarray(image.convert("RGBA"), dtype=float).reshape(-1, 4)
    except (OSError, ValueError, Image.DecompressionBombError):
        return None
    red, green, blue, alpha = (pixels.mean(axis=0) / BRIGHTEST_BYTE).tolist()
    return red, green, blue, alpha
