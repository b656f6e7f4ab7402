"""Parts as the text of a URDF, numbers to the last digit."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np

from hexapod_pin.arrays import Array
from rewriting.parts import JointPart, LinkPart, Placement, RobotParts, roll_pitch_yaw


def text_of(robot: RobotParts) -> str:
    """Return the URDF's text."""
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
