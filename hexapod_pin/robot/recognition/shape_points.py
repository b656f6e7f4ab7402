"""The shapes of a link as points and exact spheres, to find what touches the ground."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple
from xml.etree import ElementTree

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import (
    LARGEST_LENGTH,
    UrdfFile,
    length,
    lengths,
    origin,
    triple,
)
from hexapod_pin.robot.description.urdf_inertia import rotation
from hexapod_pin.robot.reading.mesh_file import read_mesh
from hexapod_pin.robot.recognition.sphere_fit import Ball, mesh_parts

if TYPE_CHECKING:
    from hexapod_pin.robot.reading.resources import ResourceFinder

RIM_POINTS = 64
"""Points that stand for a circle: its lowest one is exact to 0.12 % of the radius."""


class LinkSphere(NamedTuple):
    """A sphere among a link's shapes: centre in the link's frame (3,) [m], radius [m]."""

    centre: Array
    radius: float


class FlatEnd(NamedTuple):
    """An end face of a cylinder, in the link's frame.

    Attributes:
        centre: of the face [m]. Shape (3,).
        normal: unit vector out of it. Shape (3,).
        radius: of the face [m].
        depth: radius of the largest sphere inside that touches the centre of the face [m].
    """

    centre: Array
    normal: Array
    radius: float
    depth: float


@dataclass(frozen=True, eq=False)
class LinkShapes:
    """What a link looks like, in its own frame.

    Attributes:
        points: vertices of boxes, cylinders and meshes [m]. Shape (N, 3).
        spheres: spheres, also those that come as a mesh.
        ends: end faces of cylinders.
        lost: why a mesh gives no points, one sentence each.
    """

    points: Array
    spheres: tuple[LinkSphere, ...]
    ends: tuple[FlatEnd, ...]
    lost: tuple[str, ...]

    @property
    def empty(self) -> bool:
        """Whether there is no shape."""
        return not (len(self.points) or self.spheres)


def link_shapes(file: UrdfFile, finder: ResourceFinder, link: str) -> LinkShapes:
    """Return the collision shapes of a link, or its visual shapes where it has no others."""
    lost: list[str] = []
    for tag in ("collision", "visual"):
        gathered = _Gathered([], [], [])
        for element in file.link_by_name[link].element.findall(tag):
            if why := _gather(element, finder, gathered):
                lost.append(f"link {link!r}: {why}")
        if gathered.points or gathered.spheres:
            points = np.vstack(gathered.points) if gathered.points else np.zeros((0, 3))
            return LinkShapes(points, tuple(gathered.spheres), tuple(gathered.ends), tuple(lost))
    return LinkShapes(np.zeros((0, 3)), (), (), tuple(lost))


def link_points(file: UrdfFile, finder: ResourceFinder, link: str) -> Array:
    """Return points (N, 3) on the outside of a link's shapes, in its own frame [m].

    Collision shapes where they can be read, else visual ones; a sphere gives its six extremes.
    """
    shapes = link_shapes(file, finder, link)
    six = np.vstack([np.eye(3), -np.eye(3)])
    balls = [sphere.centre + sphere.radius * six for sphere in shapes.spheres]
    return np.vstack([shapes.points, *balls])


class _Gathered(NamedTuple):
    points: list[Array]
    spheres: list[LinkSphere]
    ends: list[FlatEnd]


def _gather(element: ElementTree.Element, finder: ResourceFinder, into: _Gathered) -> str:
    """Add one <collision> or <visual>; return why it cannot be used, or nothing."""
    xyz, rpy = origin(element)
    if not np.isfinite([*xyz, *rpy]).all():
        return "the origin of a shape has missing or non-finite numbers"
    turn, offset = rotation(rpy), np.array(xyz)
    shape = element.find("geometry")
    kind = None if shape is None or not len(shape) else shape[0]
    if kind is None:
        return ""
    if kind.tag == "mesh":
        return _gather_mesh(kind, finder, turn, offset, into)
    radius, long = length(kind, "radius"), length(kind, "length")
    if kind.tag == "sphere":
        points, balls = np.zeros((0, 3)), [(np.zeros(3), radius)]
    elif kind.tag == "box":
        points, balls = 0.5 * np.array(lengths(kind.get("size"))) * _CORNERS, []
    elif kind.tag == "cylinder":
        points, balls = np.vstack(list(_rims(radius, long))), []
    elif kind.tag == "capsule":
        half = np.array([0.0, 0.0, 0.5 * long])
        points, balls = np.zeros((0, 3)), [(half, radius), (-half, radius)]
    else:
        return f"<{kind.tag}> is no box, cylinder, sphere, capsule or mesh"
    numbers = [*points.ravel(), *(value for c, r in balls for value in (*c, r))]
    if not np.isfinite(numbers).all():
        return f"<{kind.tag}> has missing numbers, or none from 0 to {LARGEST_LENGTH:g} m"
    if kind.tag == "cylinder":
        axis, depth = turn[:, 2], min(radius, 0.5 * long)
        into.ends.extend(
            FlatEnd(offset + 0.5 * long * side, side, radius, depth) for side in (axis, -axis)
        )
    if len(points):
        into.points.append(points @ turn.T + offset)
    into.spheres.extend(LinkSphere(turn @ centre + offset, size) for centre, size in balls)
    return ""


def _gather_mesh(
    mesh: ElementTree.Element, finder: ResourceFinder, turn: Array, offset: Array, into: _Gathered
) -> str:
    """Add the parts of a mesh: spheres as such, the others as vertices."""
    name = mesh.get("filename") or ""
    path = finder.find(name)
    if path is None:
        return f"mesh {name!r}: {finder.why(name)}"
    given = mesh.get("scale")
    scale = triple(given) if given else (1.0, 1.0, 1.0)
    try:
        read = read_mesh(path, scale)
    except Exception as error:  # what a mesh reader raises is not ours to know
        return f"mesh {name!r} cannot be read: {error}"
    vertices = np.asarray(read.vertices, dtype=float)
    if not len(vertices) or not np.isfinite(vertices).all():
        return f"mesh {name!r} has no vertices, or non-finite ones"
    for part in mesh_parts(vertices @ turn.T + offset, np.asarray(read.faces, dtype=int)):
        if isinstance(part, Ball):
            into.spheres.append(LinkSphere(part.centre, part.radius))
        else:
            into.points.append(part)
    return ""


_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


def _rims(radius: float, length: float) -> Iterator[Array]:
    """Return the circles at both ends of a cylinder along z, (RIM_POINTS, 3) each."""
    angle = 2 * math.pi * np.arange(RIM_POINTS) / RIM_POINTS
    for z in (-0.5 * length, 0.5 * length):
        yield np.column_stack(
            [radius * np.cos(angle), radius * np.sin(angle), np.full(RIM_POINTS, z)]
        )
