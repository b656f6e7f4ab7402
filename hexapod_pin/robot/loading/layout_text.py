"""A URDF that states what was found in it, so that reading it again infers nothing.

The trunk's axes become those of a new root link without mass, feet that no link marks become links
with a sphere, and the <hexapod_pin> element (which other parsers ignore) states legs, posture, held
joints and what was inferred.
"""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import UrdfFile, parse_urdf
from hexapod_pin.robot.description.urdf_writer import number, numbers
from hexapod_pin.robot.recognition.layout import LegLayout, RobotLayout

TRUNK_LINK = "trunk_axes"
"""Name of the root link that turns the trunk: x forward, y left, z up."""

STATEMENT = "hexapod_pin"
"""Name of the element with which a URDF says what this package reads from it."""


def stated(file: UrdfFile, layout: RobotLayout) -> UrdfFile:
    """Return the file with its layout stated; the file itself where there is nothing to state.

    Args:
        file: a URDF without findings.
        layout: what was found in it.
    """
    if not layout.inferred:
        return file
    root = copy.deepcopy(file.root)
    known = {element.get("name") for tag in ("link", "joint") for element in root.iter(tag)}
    for leg in layout.legs:
        if leg.foot not in file.link_by_name:
            _add_foot(root, leg, known)
    if not np.array_equal(layout.turn, np.eye(3)):
        _turn_trunk(root, file.base, layout.turn, known)
    _state(root, layout)
    ET.indent(root)
    return parse_urdf(ET.tostring(root, encoding="utf-8"), file.source)


def _add_foot(root: ET.Element, leg: LegLayout, known: set[str | None]) -> None:
    """Add a foot link with its sphere, fixed to the link that carries it."""
    foot = ET.SubElement(root, "link", name=leg.foot)
    if leg.radius > 0.0:
        shape = ET.SubElement(ET.SubElement(foot, "collision"), "geometry")
        ET.SubElement(shape, "sphere", radius=number(leg.radius))
    _fix(root, leg.tip_link, leg.foot, leg.centre, np.eye(3), known)


def _turn_trunk(root: ET.Element, base: str, turn: Array, known: set[str | None]) -> None:
    """Make a new root link in the trunk's axes and fix the old one to it."""
    name = _free(TRUNK_LINK, known)
    root.insert(0, ET.Element("link", name=name))
    _fix(root, name, base, np.zeros(3), turn.T, known)


def _fix(
    root: ET.Element, parent: str, child: str, place: Array, turn: Array, known: set[str | None]
) -> None:
    """Add a fixed joint."""
    joint = ET.SubElement(root, "joint", name=_free(f"{child}_fixed", known), type="fixed")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", xyz=numbers(place.tolist()), rpy=numbers(roll_pitch_yaw(turn)))


def roll_pitch_yaw(turn: Array) -> tuple[float, float, float]:
    """Return roll, pitch, yaw [rad] with Rz(yaw) Ry(pitch) Rx(roll) = turn (3, 3)."""
    level = float(np.hypot(turn[0, 0], turn[1, 0]))
    pitch = float(np.arctan2(-turn[2, 0], level))
    if level < 1e-9:
        return float(np.arctan2(-turn[1, 2], turn[1, 1])), pitch, 0.0
    roll = float(np.arctan2(turn[2, 1], turn[2, 2]))
    return roll, pitch, float(np.arctan2(turn[1, 0], turn[0, 0]))


def _free(wanted: str, known: set[str | None]) -> str:
    """Return a name that the file does not use, and take it."""
    name = wanted
    while name in known:
        name += "_"
    known.add(name)
    return name


def _state(root: ET.Element, layout: RobotLayout) -> None:
    """Write legs, posture, held joints and what was inferred into the file's own statement."""
    element = root.find(STATEMENT)
    if element is None:
        element = ET.Element(STATEMENT)
        root.insert(0, element)
    for tag in ("leg", "posture", "held", "inferred"):
        for old in element.findall(tag):
            element.remove(old)
    for leg in layout.legs:
        separator = "\t" if any(len(joint.split()) > 1 for joint in leg.joints) else " "
        joints = separator.join(leg.joints)
        ET.SubElement(element, "leg", name=leg.name, joints=joints, foot=leg.foot)
    for joint, angle in layout.posture.items():
        ET.SubElement(element, "posture", joint=joint, angle=number(angle))
    for joint, place in layout.held.items():
        ET.SubElement(element, "held", joint=joint, position=number(place))
    for line in layout.inferred:
        ET.SubElement(element, "inferred").text = line
