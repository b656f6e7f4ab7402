"""A URDF as parts: links, shapes and joints, how they are moved about, and their text."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
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


MILLI = 1e-3
FACTORS = {
    "si": (1.0, 1.0, 1.0),
    "kg mm2": (1.0, 1.0, MILLI**2),
    "gram": (MILLI, 1.0, MILLI),
    "millimetre": (1.0, MILLI, MILLI**2),
}
"""Units of mass, length and inertia of each of `UNITS`."""


def in_units(robot: RobotParts, units: str) -> None:
    mass, length, inertia = FACTORS[units]
    for link in robot.links:
        if link.mass is not None:
            link.mass, link.inertia = link.mass / mass, link.inertia / inertia
        link.com = link.com / length
        for shape in link.shapes:
            shape.place.p = shape.place.p / length
            if length != 1.0:
                size = {"scale": "1 1 1", **shape.size} if shape.kind == "mesh" else shape.size
                shape.size = {
                    name: value if name == "filename" else _divided(value, length)
                    for name, value in size.items()
                }
    for joint in robot.joints:
        joint.place.p = joint.place.p / length


def _divided(numbers: str, length: float) -> str:
    return " ".join(repr(float(value) / length) for value in numbers.split())


def text_of(robot: RobotParts) -> str:
    root = ET.Element("robot", name=robot.name)
    for name, rgba in robot.materials.items():
        ET.SubElement(ET.SubElement(root, "material", name=name), "color", rgba=rgba)
    for link in robot.links:
        _link(root, link)
    for joint in robot.joints:
        _joint(root, joint)
    ET.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode")


def _link(root: ET.Element, link: LinkPart) -> None:
    element = ET.SubElement(root, "link", name=link.name)
    if link.mass is not None:
        inertial = ET.SubElement(element, "inertial")
        _origin(inertial, Placement(p=link.com))
        ET.SubElement(inertial, "mass", value=repr(float(link.mass)))
        upper = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2),
                 "iyz": (1, 2)}  # fmt: skip
        moments = {name: repr(float(link.inertia[place])) for name, place in upper.items()}
        ET.SubElement(inertial, "inertia", moments)
    for shape in link.shapes:
        part = ET.SubElement(element, shape.tag)
        _origin(part, shape.place)
        ET.SubElement(ET.SubElement(part, "geometry"), shape.kind, shape.size)
        if shape.material:
            ET.SubElement(part, "material", name=shape.material)


def _joint(root: ET.Element, joint: JointPart) -> None:
    element = ET.SubElement(root, "joint", name=joint.name, type=joint.kind)
    _origin(element, joint.place)
    ET.SubElement(element, "parent", link=joint.parent)
    ET.SubElement(element, "child", link=joint.child)
    if joint.limit:
        ET.SubElement(element, "axis", xyz=_numbers(joint.axis))
        limit = {name: repr(float(value)) for name, value in joint.limit.items()}
        ET.SubElement(element, "limit", limit)
    if joint.dynamics:
        ET.SubElement(element, "dynamics", joint.dynamics)


def _origin(element: ET.Element, place: Placement) -> None:
    rpy = roll_pitch_yaw(place.r)
    ET.SubElement(element, "origin", xyz=_numbers(place.p), rpy=_numbers(np.array(rpy)))


def _numbers(values: Iterable[float] | Array) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)


SPLIT_SHARES = (0.2, 0.8)
"""Least and largest share of a link's mass that goes to its new part."""

FOOT_BEYOND = 1.5
"""A foot frame beyond the sphere is this many times as far from the knee."""


def move_frame(robot: RobotParts, link: LinkPart, old: Placement) -> None:
    """Give a link another frame: `old` places its present frame in the new one."""
    link.com = old.r @ link.com + old.p
    link.inertia = old.r @ link.inertia @ old.r.T
    for shape in link.shapes:
        shape.place = old @ shape.place
    for joint in robot.joints:
        if joint.parent == link.name:
            joint.place = old @ joint.place


def turn_child(robot: RobotParts, joint: JointPart, turn: Array, slide: float) -> None:
    """Turn a joint's frame by a rotation (3, 3) and slide it along its axis [m]."""
    new = Placement(turn, slide * joint.axis)  # the new frame in the old
    joint.place = joint.place @ new
    joint.axis = turn.T @ joint.axis
    move_frame(robot, robot.link(joint.child), new.inverse())


def shift_zero(joint: JointPart, zero: float) -> None:
    joint.place = joint.place @ Placement(about(joint.axis, zero))
    joint.limit["lower"] -= zero
    joint.limit["upper"] -= zero


def flip_axis(joint: JointPart) -> None:
    joint.axis = -joint.axis
    lower, upper = joint.limit["lower"], joint.limit["upper"]
    joint.limit["lower"], joint.limit["upper"] = -upper, -lower


def put_fixed_link_before(robot: RobotParts, joint: JointPart, new: Placement) -> None:
    between = LinkPart(f"{joint.name}_mount", None, np.zeros(3), np.zeros((3, 3)), [])
    fixed = _fixed(f"{joint.name}_fixed", joint.parent, between.name, new)
    joint.parent, joint.place = between.name, new.inverse() @ joint.place
    robot.links.append(between)
    robot.joints.append(fixed)


def split(robot: RobotParts, link: LinkPart, share: float, place: Placement) -> None:
    """Put a share of a link's mass into a new link that is fixed to it at a placement.

    Both parts keep the centre of mass, so mass and inertia are the same together.
    """
    if link.mass is None:
        return
    part = LinkPart(f"{link.name}_part", share * link.mass, link.com.copy(), link.inertia, [])
    part.inertia = share * link.inertia
    link.mass, link.inertia = (1.0 - share) * link.mass, (1.0 - share) * link.inertia
    robot.links.append(part)
    robot.joints.append(_fixed(f"{link.name}_part_joint", link.name, part.name, place))
    move_frame(robot, part, place.inverse())


def place_foot(robot: RobotParts, joint: JointPart, frame: str) -> None:
    foot = robot.link(joint.child)
    if frame == "none":
        parent = robot.link(joint.parent)
        for shape in foot.shapes:
            shape.place = joint.place @ shape.place
        parent.shapes += foot.shapes
        robot.links.remove(foot)
        robot.joints.remove(joint)
        return
    away = {"at the sphere": 1.0, "at the knee": 0.0, "beyond the sphere": FOOT_BEYOND}[frame]
    new = Placement(p=(away - 1.0) * (joint.place.r.T @ joint.place.p))
    joint.place = joint.place @ new
    move_frame(robot, foot, new.inverse())


def _fixed(name: str, parent: str, child: str, place: Placement) -> JointPart:
    return JointPart(name, "fixed", parent, child, place, np.array([1.0, 0.0, 0.0]), {}, {})
