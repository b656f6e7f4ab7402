"""Points and spheres of the shapes of links, and of a leg's last body in one frame."""

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
    mesh_scale,
    origin,
)
from hexapod_pin.robot.reading.mesh_file import read_mesh
from hexapod_pin.robot.recognition.chains import Axis, Chain, TreeFrames
from hexapod_pin.robot.rotations import rotation

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
    try:
        read = read_mesh(path, mesh_scale(mesh))
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


# Spheres that come as triangles: a tessellated foot gives back its centre and radius.

ROUND = 0.01
"""Vertices lie on a sphere when their distances from its centre differ by less than this share."""

FLAT = 0.75
"""No face of a tessellated sphere is nearer to its centre than this share of the radius; those
of a box (at most 0.58) and of a cylinder (at most 0.71) are, although their vertices lie on one."""

FEWEST = 12
"""Vertices of the coarsest sphere that is taken for one: an icosahedron."""


class Ball(NamedTuple):
    """A sphere: centre (3,) [m] and radius [m]."""

    centre: Array
    radius: float


def mesh_parts(vertices: Array, faces: Array) -> Iterator[Ball | Array]:
    """Return the connected parts of a mesh: spheres as `Ball`, the others as vertices (N, 3).

    Args:
        vertices: [m]. Shape (N, 3).
        faces: three vertices each. Shape (M, 3).
    """
    points, merged = np.unique(vertices, axis=0, return_inverse=True)
    triangles = merged.reshape(-1)[faces] if len(faces) else np.zeros((0, 3), dtype=int)
    labels = _connected(len(points), triangles)
    for label in np.unique(labels):
        part = labels == label
        chosen = triangles[part[triangles[:, 0]]] if len(triangles) else triangles
        ball = _closed_ball(points, part, chosen)
        yield points[part] if ball is None else ball


def fitted_ball(points: Array) -> Ball | None:
    """Return the sphere through points (N, 3) by least squares; None where they lie on none.

    |p|^2 = 2 c . p + (r^2 - c^2) is linear in the centre and in the last term: exact where the
    points are (Coope, J. Optim. Theory Appl. 76, 1993).
    """
    if len(points) < 4:
        return None
    middle = points.mean(axis=0)
    size = float(np.abs(points - middle).max())
    if size == 0:
        return None
    scaled = (points - middle) / size
    matrix = np.column_stack([2 * scaled, np.ones(len(scaled))])
    solution, _, rank, _ = np.linalg.lstsq(matrix, (scaled**2).sum(axis=1), rcond=1e-9)
    square = float(solution[3] + solution[:3] @ solution[:3])
    if rank < 4 or square <= 0:
        return None
    centre, radius = middle + size * solution[:3], size * square**0.5
    off = np.abs(np.linalg.norm(points - centre, axis=1) - radius).max()
    return Ball(centre, radius) if off <= ROUND * radius else None


def _closed_ball(points: Array, part: Array, triangles: Array) -> Ball | None:
    """Return the sphere that a connected part is, None where it is none."""
    if part.sum() < FEWEST:
        return None
    ball = fitted_ball(points[part])
    if ball is None:
        return None
    a, b, c = (points[triangles[:, k]] - ball.centre for k in range(3))
    normals = np.cross(b - a, c - a)
    sizes = np.linalg.norm(normals, axis=1)
    sound = sizes > 1e-9 * ball.radius**2
    if not sound.any():
        return None
    height = np.abs((normals[sound] * a[sound]).sum(axis=1)) / sizes[sound]
    return ball if height.min() >= FLAT * ball.radius else None


def _connected(count: int, triangles: Array) -> Array:
    """Return the number of the connected part that each vertex belongs to."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if not len(triangles):
        return np.zeros(count, dtype=int)
    edges = np.vstack([triangles[:, :2], triangles[:, 1:]])
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    labels: Array = connected_components(graph, directed=False)[1]
    return labels


# The last body of a leg: everything beyond its last turning joint, as shapes in one frame.

NOTHING = 1e-9
"""A shape that reaches no further than this from the last joint's axis shows no foot [m]."""


class BodySphere(NamedTuple):
    """A sphere on a leg's last body, root link's frame.

    Attributes:
        link: that carries it.
        centre: [m]. Shape (3,).
        radius: [m].
        stated: whether it is the link's first collision sphere: the file's own foot sphere.
    """

    link: str
    centre: Array
    radius: float
    stated: bool


class BodyEnd(NamedTuple):
    """An end face of a cylinder on a leg's last body, root link's frame."""

    link: str
    face: FlatEnd


@dataclass(frozen=True, eq=False)
class LegBody:
    """Shapes beyond a leg's last turning joint at q = 0, root link's frame.

    Attributes:
        chain: the leg.
        axis: of its last turning joint.
        points: vertices [m]. Shape (N, 3).
        owners: index into `chain.body` of the link of each point. Shape (N,).
        spheres: exact spheres.
        ends: end faces of cylinders.
        lost: why meshes give no points.
    """

    chain: Chain
    axis: Axis
    points: Array
    owners: Array
    spheres: tuple[BodySphere, ...]
    ends: tuple[BodyEnd, ...]
    lost: tuple[str, ...]

    @property
    def empty(self) -> bool:
        """Whether there is no shape away from the last joint's axis."""
        return self.reach <= NOTHING

    @property
    def reach(self) -> float:
        """Largest distance of any shape from the axis of the last joint [m]."""
        across = np.linalg.norm(self.axis.arm(self.points), axis=1)
        balls = [np.linalg.norm(self.axis.arm(s.centre)) + s.radius for s in self.spheres]
        return float(max([*across, *balls], default=0.0))

    def furthest(self) -> Array:
        """Return the unit direction from the last joint's axis to the furthest shape. (3,)."""
        arms = self.axis.arm(self.points)
        balls = [self.axis.arm(s.centre) for s in self.spheres]
        across = np.linalg.norm(arms, axis=1)
        sizes = [
            float(np.linalg.norm(a)) + s.radius for a, s in zip(balls, self.spheres, strict=True)
        ]
        reach = self.reach
        near = [a for a, s in zip(balls, sizes, strict=True) if s > 0.98 * reach]
        near += list(arms[across > 0.98 * reach])
        return _unit(np.sum([_unit(arm) for arm in near], axis=0) + np.zeros(3))


def _unit(vector: Array) -> Array:
    """Return a vector (3,) at unit length; zeros for zeros, as of a shape on the axis."""
    size = float(np.linalg.norm(vector))
    return vector / size if size > 0.0 else np.zeros(3)


def leg_body(file: UrdfFile, finder: ResourceFinder, frames: TreeFrames, chain: Chain) -> LegBody:
    """Return the shapes beyond a leg's last turning joint."""
    points, owners = [np.zeros((0, 3))], [np.zeros(0, dtype=int)]
    spheres: list[BodySphere] = []
    ends: list[BodyEnd] = []
    lost: list[str] = []
    for index, link in enumerate(chain.body):
        shapes, pose = link_shapes(file, finder, link), frames.links[link]
        points.append(pose.act(shapes.points))
        owners.append(np.full(len(shapes.points), index))
        stated = file.link_by_name[link].collision_sphere
        for sphere in shapes.spheres:
            own = (
                stated is not None
                and sphere.radius == stated.radius
                and np.allclose(sphere.centre, stated.centre, rtol=0, atol=1e-12)
            )
            spheres.append(BodySphere(link, pose.act(sphere.centre), sphere.radius, own))
        for end in shapes.ends:
            face = FlatEnd(pose.act(end.centre), pose.rotation @ end.normal, end.radius, end.depth)
            ends.append(BodyEnd(link, face))
        lost += shapes.lost
    return LegBody(
        chain, frames.axes[chain.joints[-1].name], np.vstack(points), np.concatenate(owners),
        tuple(spheres), tuple(ends), tuple(lost),
    )  # fmt: skip
