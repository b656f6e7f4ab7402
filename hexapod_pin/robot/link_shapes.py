"""The shapes that a URDF gives its links, as primitives in the frame of the joint that moves them.

Boxes, cylinders and spheres are taken as written; a mesh becomes its bounding box.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal
from xml.etree import ElementTree

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import MeshError
from hexapod_pin.robot.description.urdf_file import (
    LARGEST_LENGTH,
    UrdfFile,
    length,
    lengths,
    origin,
    parse_urdf,
    triple,
)
from hexapod_pin.robot.description.urdf_inertia import rotation
from hexapod_pin.robot.loading.pin_model import placement
from hexapod_pin.robot.once_per_robot import once_per_robot
from hexapod_pin.robot.reading.mesh_file import read_mesh
from hexapod_pin.robot.reading.resources import ResourceFinder

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

Kind = Literal["box", "cylinder", "sphere"]
Element = Literal["collision", "visual"]


@dataclass(frozen=True, eq=False)
class LinkShape:
    """A primitive fixed to a link.

    Attributes:
        link: name of the link.
        joint: name of the joint that moves it ("root_joint" for the trunk).
        kind: box, cylinder (axis z) or sphere.
        size: full edges x, y, z; or radius and length; or radius [m].
        rotation: (3, 3) attitude in the joint's frame.
        position: (3,) centre in the joint's frame [m].
        from_mesh: whether it is the bounding box of a mesh.
    """

    link: str
    joint: str
    kind: Kind
    size: tuple[float, ...]
    rotation: Array
    position: Array
    from_mesh: bool = False


@once_per_robot
def urdf_of(robot: Robot) -> UrdfFile:
    """Return the robot's URDF as links and joints."""
    return parse_urdf(robot.urdf.encode(), robot.source)


@once_per_robot
def resources_of(robot: Robot) -> ResourceFinder:
    """Return what finds the robot's meshes."""
    return ResourceFinder(robot.source)


def link_shapes(
    robot: Robot, links: Iterable[str], element: Element, *, meshes: bool
) -> tuple[list[LinkShape], list[str]]:
    """Return the shapes of links, and a text on each that cannot be used.

    Args:
        robot: the robot.
        links: names of links.
        element: "collision" or "visual".
        meshes: read meshes too; else they count as not usable.
    """
    file, shapes, unusable = urdf_of(robot), [], []
    for link in links:
        for found in file.link_by_name[link].element.findall(element):
            try:
                shapes.append(_shape(robot, link, found, meshes=meshes))
            except ValueError as error:
                unusable.append(f"{element} shape of {link}: {error}")
    return shapes, unusable


def _shape(robot: Robot, link: str, element: ElementTree.Element, *, meshes: bool) -> LinkShape:
    """Return one shape; ValueError says why it cannot be used."""
    xyz, rpy = origin(element)
    kind, size, centre, is_mesh = _geometry(robot, element, meshes=meshes)
    if not (all(map(math.isfinite, (*xyz, *rpy, *size))) and min(size) > 0.0):
        raise ValueError(f"its numbers are not above 0 and at most {LARGEST_LENGTH:g} m")
    joint, place = placement(robot.model, link)
    turn = rotation(rpy)
    return LinkShape(
        link, joint, kind, size,
        rotation=read_only(place.rotation @ turn),
        position=read_only(place.act(np.array(xyz) + turn @ np.array(centre))),
        from_mesh=is_mesh,
    )  # fmt: skip


def _geometry(
    robot: Robot, element: ElementTree.Element, *, meshes: bool
) -> tuple[Kind, tuple[float, ...], tuple[float, ...], bool]:
    """Return kind, size, centre in the shape's own frame [m], and whether it was a mesh."""
    zero = (0.0, 0.0, 0.0)
    if (box := element.find("geometry/box")) is not None:
        return "box", lengths(box.get("size")), zero, False
    if (cylinder := element.find("geometry/cylinder")) is not None:
        return "cylinder", (length(cylinder, "radius"), length(cylinder, "length")), zero, False
    if (sphere := element.find("geometry/sphere")) is not None:
        return "sphere", (length(sphere, "radius"),), zero, False
    mesh = element.find("geometry/mesh")
    if mesh is None or not meshes:
        raise ValueError("a mesh" if mesh is not None else "no box, cylinder, sphere or mesh")
    low, high = _mesh_bounds(robot, mesh)
    return "box", tuple((high - low).tolist()), tuple((0.5 * (low + high)).tolist()), True


def _mesh_bounds(robot: Robot, mesh: ElementTree.Element) -> Array:
    """Return (2, 3) lowest and highest coordinates [m]; ValueError where a mesh is unreadable."""
    name = mesh.get("filename") or ""
    path = resources_of(robot).find(name)
    if path is None:
        raise ValueError(f"mesh {name!r} not found")
    scale = triple(mesh.get("scale")) if mesh.get("scale") else (1.0, 1.0, 1.0)
    try:
        return read_mesh(path, scale).bounds
    except MeshError as error:
        raise ValueError(f"mesh {name!r} {error.reason}") from error
