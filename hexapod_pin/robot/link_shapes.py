"""The shapes of links are reduced to primitives.

By the outermost points of the trunk a robot is found to have fallen or sat down.

Boxes, cylinders and spheres are taken as written; a mesh becomes its bounding box.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal
from xml.etree import ElementTree

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import MeshError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.description.urdf_file import (
    LARGEST_LENGTH,
    UrdfFile,
    length,
    lengths,
    mesh_scale,
    origin,
    parse_urdf,
)
from hexapod_pin.robot.loading.pin_model import placement
from hexapod_pin.robot.reading.mesh_file import read_mesh
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.robot import once_per_robot
from hexapod_pin.robot.rotations import rotation

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


def mesh_finder(robot: Robot, package_path: Sequence[str | Path] = ()) -> ResourceFinder:
    """Return what finds a robot's meshes: in further folders, then in those of its options."""
    return ResourceFinder(robot.source, (*package_path, *robot.options.get("package_path", ())))


@once_per_robot
def resources_of(robot: Robot) -> ResourceFinder:
    """Return what finds the robot's meshes, in the folders it was loaded with, too."""
    return mesh_finder(robot)


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
    """Return one shape; a ValueError has the reason why it cannot be used."""
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
    try:
        return read_mesh(path, mesh_scale(mesh)).bounds
    except MeshError as error:
        raise ValueError(f"mesh {name!r} {error.reason}") from error


# The trunk's outermost points, which touch the ground where a robot falls or sits down.

MAX_TRUNK_POINTS = 16
"""How many points stand for a trunk at most."""

RIM_POINTS = 8
"""Points on each rim of a cylinder."""

THICKNESS_SHARE = 0.4
"""Thickness of a trunk without shapes over the smaller side of its hips' rectangle (*assumed*)."""

SIGNS = {-1.0: "-", 1.0: "+"}

Point = tuple[str, Array, float]


@dataclass(frozen=True, eq=False)
class TrunkPoints(Immutable):
    """Spheres fixed to the trunk; radius 0 is a corner.

    Attributes:
        points: centres in the base frame [m]. Shape (K, 3).
        radius: radii [m]. Shape (K,).
        names: such as "base_link +x-y-z", the signs in the shape's own axes.
        assumed: what is assumed of them; empty where the URDF's collision shapes give all.
    """

    points: Array
    radius: Array
    names: tuple[str, ...]
    assumed: str = ""

    def __len__(self) -> int:
        """Return K."""
        return len(self.names)


@checked
@once_per_robot
def trunk_points(robot: Robot) -> TrunkPoints:
    """Return at most 16 points of the base link and the links fixed to it, feet excepted.

    From their collision shapes, else from their drawn shapes, else of a box around the hips:
    corners of boxes (of meshes: of their bounding boxes), eight points on each rim of a cylinder,
    spheres as they are. Of more than 16 those that reach farthest in 16 directions are used.

    Returns:
        No points where the base has no shapes, and fewer than three hips or hips on one line.
    """
    file = urdf_of(robot)
    feet = {foot.name for foot in robot.feet}
    links = [name for name in file.rigid_group(file.base) if name not in feet]
    points, notes = _from_shapes(robot, links)
    if not points:
        points, note = _around_hips(robot, file)
        notes = [*notes, note] if points else []
    if len(points) > MAX_TRUNK_POINTS:
        outermost = _outermost(points)
        notes.append(f"{len(outermost)} of {len(points)} points kept")
        points = outermost
    return TrunkPoints(
        points=read_only(np.array([place for _, place, _ in points]).reshape(-1, 3)),
        radius=read_only([radius for _, _, radius in points]),
        names=tuple(name for name, _, _ in points),
        assumed="; ".join(notes),
    )


def _from_shapes(robot: Robot, links: Sequence[str]) -> tuple[list[Point], list[str]]:
    """Return the points of collision shapes, else of drawn ones, and what is assumed."""
    notes: list[str] = []
    for element in ("collision", "visual"):
        shapes, unusable = link_shapes(robot, links, element, meshes=True)
        notes += unusable
        if not shapes:
            continue
        if element == "visual":
            notes.append("the trunk is as large as it is drawn")
        if any(shape.from_mesh for shape in shapes):
            notes.append("a mesh is its bounding box")
        return _distinct([point for shape in shapes for point in _points(shape)]), notes
    return [], notes


def _points(shape: LinkShape) -> Iterator[Point]:
    """Return the points of one shape in the base frame."""
    if shape.kind == "sphere":
        yield f"{shape.link} sphere", shape.position, shape.size[0]
        return
    local = _corners(shape.size) if shape.kind == "box" else _rims(*shape.size)
    for name, place in local:
        yield f"{shape.link} {name}", shape.position + shape.rotation @ place, 0.0


def _corners(size: Sequence[float]) -> Iterator[tuple[str, Array]]:
    """Return the corners of a box in its own frame [m]."""
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        name = "".join(SIGNS[sign] + axis for sign, axis in zip(signs, "xyz", strict=True))
        yield name, 0.5 * np.array(signs) * size


def _rims(radius: float, length: float) -> Iterator[tuple[str, Array]]:
    """Return points on both rims of a cylinder along z, in its own frame [m]."""
    for sign, k in itertools.product((-1.0, 1.0), range(RIM_POINTS)):
        angle = 2.0 * np.pi * k / RIM_POINTS
        place = np.array([radius * np.cos(angle), radius * np.sin(angle), 0.5 * sign * length])
        yield f"{SIGNS[sign]}z rim {360 * k // RIM_POINTS} deg", place


def _around_hips(robot: Robot, file: UrdfFile) -> tuple[list[Point], str]:
    """Return the corners of a box around the origins of the joints on the trunk."""
    names = [joint.name for joint in file.moved_joints_below(file.base)]
    model = robot.model
    hips = np.array(
        [model.jointPlacements[model.getJointId(name)].translation for name in names]
    ).reshape(-1, 3)
    if np.linalg.matrix_rank(hips[:, :2] - hips[:1, :2], tol=1e-6) < 2:
        return [], ""
    low, high = hips.min(axis=0), hips.max(axis=0)
    thickness = THICKNESS_SHARE * float(np.min((high - low)[:2]))
    size = high - low + np.array([0.0, 0.0, thickness])
    points = [
        (f"{file.base} {name}", 0.5 * (low + high) + place, 0.0) for name, place in _corners(size)
    ]
    return points, f"the trunk is a box around the hips, {thickness:.3g} m thick"


def _distinct(points: list[Point]) -> list[Point]:
    """Return the points without those that repeat another."""
    distinct: list[Point] = []
    for name, place, radius in points:
        if not any(np.allclose(place, p, atol=1e-9) and radius == r for _, p, r in distinct):
            distinct.append((name, place, radius))
    return distinct


def _outermost(points: list[Point]) -> list[Point]:
    """Return the points that reach farthest in 16 directions, most of them downwards."""
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) / np.sqrt(3.0)
    angle = np.radians(22.5 + 45.0 * np.arange(8))
    below = np.stack([np.cos(angle), np.sin(angle), np.full(8, -1.0)], axis=1) / np.sqrt(2.0)
    places = np.array([place for _, place, _ in points])
    reach = places @ np.concatenate([corners, below]).T
    reach += np.array([radius for _, _, radius in points])[:, None]
    return [points[k] for k in sorted(set(reach.argmax(axis=0).tolist()))]
