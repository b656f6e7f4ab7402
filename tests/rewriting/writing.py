"""Parts as the text of a URDF, numbers to the last digit, in SI or in what exporters get wrong."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np

from hexapod_pin.arrays import Array
from rewriting.parts import JointPart, LinkPart, Placement, RobotParts, roll_pitch_yaw

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
