"""A URDF as plain parts that can be moved about: links, shapes and joints with their placements."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import UrdfFile, origin
from hexapod_pin.robot.rotations import rotation


@dataclass(eq=False)
class Placement:
    """A rotation (3, 3) and a translation (3,) [m] from an inner to an outer frame."""

    r: Array = field(default_factory=lambda: np.eye(3))
    p: Array = field(default_factory=lambda: np.zeros(3))

    def __matmul__(self, inner: Placement) -> Placement:
        """Return the placement of an inner frame's inner frame."""
        return Placement(self.r @ inner.r, self.r @ inner.p + self.p)

    def inverse(self) -> Placement:
        return Placement(self.r.T, -self.r.T @ self.p)


@dataclass(eq=False)
class Shape:
    """A <visual> or <collision>: its geometry as an element name and attributes."""

    tag: str
    place: Placement
    kind: str
    size: dict[str, str]
    material: str | None = None


@dataclass(eq=False)
class LinkPart:
    """A link; `inertia` is about the centre of mass in the link's axes [kg m^2]. (3, 3)."""

    name: str
    mass: float | None
    com: Array
    inertia: Array
    shapes: list[Shape]


@dataclass(eq=False)
class JointPart:
    """A joint; its numbers as in the URDF."""

    name: str
    kind: str
    parent: str
    child: str
    place: Placement
    axis: Array
    limit: dict[str, float]
    dynamics: dict[str, str]


@dataclass(eq=False)
class RobotParts:
    """All parts of a robot, and its materials' colours as text."""

    name: str
    links: list[LinkPart]
    joints: list[JointPart]
    materials: dict[str, str]

    @property
    def root(self) -> LinkPart:
        carried = {joint.child for joint in self.joints}
        return next(link for link in self.links if link.name not in carried)

    def link(self, name: str) -> LinkPart:
        return next(link for link in self.links if link.name == name)


def parts_of(file: UrdfFile) -> RobotParts:
    links = []
    for link in file.links:
        xx, yy, zz, xy, xz, yz = link.moments if link.mass is not None else (0.0,) * 6
        turn = rotation(link.inertia_rpy)
        inertia = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
        shapes = [_shape(e) for e in link.element if e.tag in ("visual", "collision")]
        links.append(LinkPart(link.name, link.mass, np.array(link.com), inertia, shapes))
    joints = []
    for joint in file.joints:
        limit = {k: joint.limit(k) for k in ("lower", "upper", "effort", "velocity")}
        dynamics = joint.element.find("dynamics")
        place = Placement(rotation(joint.rpy), np.array(joint.xyz))
        part = JointPart(joint.name, joint.kind, joint.parent, joint.child, place,
                         np.array(joint.axis), limit if joint.moves else {},
                         {} if dynamics is None else dict(dynamics.attrib))  # fmt: skip
        joints.append(part)
    materials = {
        e.get("name", ""): color.get("rgba", "")
        for e in file.root.findall("material")
        if (color := e.find("color")) is not None
    }
    return RobotParts(file.name, links, joints, materials)


def about(axis: Array, angle: float) -> Array:
    turned: Array = Rotation.from_rotvec(angle * axis).as_matrix()
    return turned


def roll_pitch_yaw(r: Array) -> tuple[float, float, float]:
    """Return roll, pitch, yaw of a rotation [rad], exact also where the pitch is a right angle."""
    yaw = float(np.arctan2(r[1, 0], r[0, 0]))
    rest = rotation((0.0, 0.0, -yaw)) @ r
    roll = float(np.arctan2(-rest[1, 2], rest[1, 1]))
    return roll, float(np.arctan2(-rest[2, 0], rest[0, 0])), yaw


def _shape(element: ET.Element) -> Shape:
    xyz, rpy = origin(element)
    geometry = element.find("geometry")
    kind = geometry[0] if geometry is not None else ET.Element("none")
    material = element.find("material")
    name = None if material is None else material.get("name")
    place = Placement(rotation(rpy), np.array(xyz))
    return Shape(element.tag, place, kind.tag, dict(kind.attrib), name)
