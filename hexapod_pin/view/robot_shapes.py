"""A playback draws the shapes of a robot's links and the meshes of its URDF."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.errors import MeshError, ParameterError, ViewerError
from hexapod_pin.robot.description.urdf_file import mesh_scale, origin
from hexapod_pin.robot.reading.mesh_file import Mesh, read_mesh
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.rotations import rotation
from hexapod_pin.user_file import read_bytes
from hexapod_pin.view.mesh_store import MeshStore

STICK_COLOR = (0.45, 0.5, 0.55, 1.0)
STICK_WIDTH = 0.06  # radius of a stand-in stick over its length
TRUNK_HEIGHT = 0.3  # least side of a stand-in trunk over its second side
TRUNK_OPACITY = 0.6  # so that the sticks show
Y_TO_Z = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # three.js cylinder axis


@dataclass(frozen=True)
class DrawnShape:
    """A primitive or a mesh fixed to a body.

    Attributes:
        geometry: three.js type and sizes [m], e.g. {"type": "SphereGeometry", "radius": 0.01}; of
            a mesh, its arrays.
        rotation: (3, 3) attitude in the body's frame.
        position: (3,) [m] in the body's frame.
        color: red, green, blue, opacity; 0 to 1.
    """

    geometry: Mapping[str, Any]
    rotation: Array
    position: Array
    color: tuple[float, float, float, float]


def box(size: npt.ArrayLike) -> dict[str, Any]:
    """Return a box of full lengths x, y, z [m]."""
    width, height, depth = np.asarray(size, dtype=float).tolist()
    return {"type": "BoxGeometry", "width": width, "height": height, "depth": depth}


def sphere(radius: float) -> dict[str, Any]:
    """Return a sphere [m]."""
    return {
        "type": "SphereGeometry",
        "radius": float(radius),
        "widthSegments": 20,
        "heightSegments": 20,
    }


def cylinder(radius: float, length: float, *, top_radius: float | None = None) -> dict[str, Any]:
    """Return a cylinder or, with a `top_radius`, a cone [m]; its axis is y, see `Y_TO_Z`."""
    top = radius if top_radius is None else top_radius
    sizes = {"radiusTop": float(top), "radiusBottom": float(radius), "height": float(length)}
    return {"type": "CylinderGeometry", "radialSegments": 24, **sizes}


class RobotShapes:
    """The shapes of each moving body of a URDF, bodies named by the joint that carries them.

    Boxes, cylinders and spheres are drawn as the file has them, and meshes decimated. A body of
    which nothing can be drawn is shown as sticks from its joint to the next joints and feet, a
    trunk as a box around its hips, too.
    """

    def __init__(
        self,
        urdf: str,
        feet: Mapping[str, float],
        *,
        finder: ResourceFinder | None = None,
        store: MeshStore | None = None,
    ) -> None:
        """Read the URDF.

        Args:
            urdf: text of the file.
            feet: radius [m] of every foot, by the link's name.
            finder: looks for the files of meshes; None finds none.
            store: takes the meshes of one picture; None draws none.

        Raises:
            ViewerError: the text cannot be read as a URDF.
        """
        import pinocchio as pin

        try:
            text = _without_meshes(urdf)
            self.model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
            self._visuals = pin.buildGeomFromUrdfString(self.model, text, pin.VISUAL)
        except (ValueError, ElementTree.ParseError) as error:
            raise ViewerError(f"the trace's URDF cannot be drawn: {error}") from error
        self._feet = feet
        visuals, self.notes = ([], []) if store is None else mesh_visuals(urdf, finder)
        self._meshes = [(visual, store.add(visual.mesh)) for visual in visuals] if store else []
        self._store = store

    @cached_property
    def bodies(self) -> dict[str, list[DrawnShape]]:
        """The shapes of every body."""
        found: dict[str, list[DrawnShape]] = {name: [] for name in self.model.names[1:]}
        for visual in self._visuals.geometryObjects:
            shape = _primitive(visual)
            if shape is not None and visual.parentJoint > 0:
                found[self.model.names[visual.parentJoint]].append(shape)
        for body, mesh in self._drawn_meshes():
            found[body].append(mesh)
        for joint, name in enumerate(self.model.names):
            if joint and not found[name]:
                found[name] = self._sticks(joint)
        return found

    def _drawn_meshes(self) -> Iterator[tuple[str, DrawnShape]]:
        """Yield every mesh with the name of the body that carries it."""
        import pinocchio as pin

        for visual, key in self._meshes:
            number = self.model.getFrameId(visual.link, pin.FrameType.BODY)
            frame = self.model.frames[number]
            if self._store is None or frame.parentJoint == 0:
                continue
            place = frame.placement
            yield (
                self.model.names[frame.parentJoint],
                DrawnShape(
                    self._store.geometry(key),
                    np.array(place.rotation) @ visual.rotation,
                    np.array(place.act(visual.position)),
                    visual.color,
                ),
            )

    def _sticks(self, joint: int) -> list[DrawnShape]:
        """Return stand-ins for a body without drawable shapes; a trunk is a box around its hips."""
        feet = [self._frame(joint, name) for name in self._feet]
        ends = [self.model.jointPlacements[k].translation for k in self.model.children[joint]]
        middle = np.mean(ends, axis=0) if joint == 1 and ends else np.zeros(3)
        points = (*ends, *(foot for foot in feet if foot is not None))
        shapes = [_stick(np.asarray(end), middle) for end in points]
        if joint == 1:
            shapes.append(_box_around(np.array(ends).reshape(-1, 3)))
        for foot, radius in zip(feet, self._feet.values(), strict=True):
            if foot is not None:
                shapes.append(DrawnShape(sphere(max(radius, 0.004)), np.eye(3), foot, STICK_COLOR))
        return [shape for shape in shapes if shape is not None]

    def _frame(self, joint: int, name: str) -> Array | None:
        """Return where a link's frame sits on a body, if it is on that body."""
        import pinocchio as pin

        if not self.model.existFrame(name, pin.FrameType.BODY):
            return None
        frame = self.model.frames[self.model.getFrameId(name, pin.FrameType.BODY)]
        return np.array(frame.placement.translation) if frame.parentJoint == joint else None


def _without_meshes(urdf: str) -> str:
    """Return the URDF without visuals that need another file."""
    root = ElementTree.fromstring(urdf)
    for link in root.iter("link"):
        for visual in link.findall("visual"):
            if visual.find("geometry/mesh") is not None:
                link.remove(visual)
    return ElementTree.tostring(root, encoding="unicode")


def _primitive(visual: Any) -> DrawnShape | None:
    """Return a box, cylinder or sphere of Pinocchio's geometry model; None for other shapes."""
    shape, rotation = visual.geometry, np.array(visual.placement.rotation)
    kind = type(shape).__name__
    if kind == "Box":
        geometry = box(2.0 * np.asarray(shape.halfSide))
    elif kind == "Cylinder":
        geometry, rotation = cylinder(shape.radius, 2.0 * shape.halfLength), rotation @ Y_TO_Z
    elif kind == "Sphere":
        geometry = sphere(shape.radius)
    else:
        return None
    red, green, blue, opacity = (float(part) for part in visual.meshColor)
    position = np.array(visual.placement.translation)
    return DrawnShape(geometry, rotation, position, (red, green, blue, opacity))


def _box_around(hips: Array) -> DrawnShape | None:
    """Return a box around points of a trunk (K, 3) [m]; None where they are in one line or none."""
    if len(hips) < 3:
        return None
    low, high = hips.min(axis=0), hips.max(axis=0)
    sides = high - low
    thin = TRUNK_HEIGHT * float(np.sort(sides)[1])
    if thin <= 0.0:
        return None
    color = (*STICK_COLOR[:3], TRUNK_OPACITY)
    return DrawnShape(box(np.maximum(sides, thin)), np.eye(3), 0.5 * (low + high), color)


def _stick(end: Array, start: Array) -> DrawnShape | None:
    """Return a cylinder between two points (3,) of a body [m]; None for no length."""
    import pinocchio as pin

    along = end - start
    length = float(np.linalg.norm(along))
    if length < 1e-6:
        return None
    upright = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length)
    geometry = cylinder(STICK_WIDTH * length, length)
    return DrawnShape(geometry, upright.matrix() @ Y_TO_Z, 0.5 * (start + end), STICK_COLOR)


# The meshes that a URDF draws its links with: where they are fixed, and their colours.

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
    """Return one mesh; an error has the reason why it cannot be drawn."""
    shape: Any = element.find("geometry/mesh")
    name = shape.get("filename") or ""
    if finder is None:
        raise ValueError(f"{name}: it is not known in which folder the URDF was")
    path = finder.find(name)
    if path is None:
        raise ValueError(finder.why(name))
    mesh = read_mesh(path, mesh_scale(shape))
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
