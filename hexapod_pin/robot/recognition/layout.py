"""A layout holds what was recognised in a URDF.

It is written into the URDF, so that reading the text again infers nothing; provenance says where
the numbers come from.
"""

from __future__ import annotations

import copy
import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import UrdfFile, attribute, parse_urdf
from hexapod_pin.robot.description.urdf_writer import number, numbers


@dataclass(frozen=True, eq=False)
class LegLayout:
    """One leg as it is found.

    Attributes:
        name: of the leg: lf, lm, lr, rf, rm, rr where there are six.
        joints: the joints that walk, from the trunk outwards. Two or three.
        held: other moved joints between the trunk and the foot: they keep an angle.
        tip_link: the link that carries the foot.
        foot: name of the foot link; a new one where no link of the file is the foot.
        centre: centre of the foot sphere in the frame of `tip_link` [m]. Shape (3,).
        radius: of that sphere [m]; 0 is a point.
    """

    name: str
    joints: tuple[str, ...]
    held: tuple[str, ...]
    tip_link: str
    foot: str
    centre: Array
    radius: float


@dataclass(frozen=True, eq=False)
class RobotLayout:
    """The robot in a URDF.

    Attributes:
        turn: the trunk's axes in the frame of the root link: columns forward, left, up. (3, 3).
        legs: in the order of `leg_names`.
        held: every moved joint that does not walk (head, arm, surplus leg joint, foot spring) with
            the place where it is held [rad or m].
        posture: standing angle of every joint that walks [rad].
        inferred: what was inferred and from what, a sentence each; empty where the file says all.
    """

    turn: Array
    legs: tuple[LegLayout, ...]
    held: Mapping[str, float] = field(default_factory=dict)
    posture: Mapping[str, float] = field(default_factory=dict)
    inferred: tuple[str, ...] = ()


# A URDF that states what was found in it, so that reading it again infers nothing.
#
# The trunk's axes become those of a new root link without mass, feet that no link marks become
# links with a sphere, and the <hexapod_pin> element (which other parsers ignore) states legs,
# posture, held joints and what was inferred.

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


# Where a URDF's numbers come from: its own <hexapod_pin> element, or its name and path.


@dataclass(frozen=True)
class Provenance:
    """What a URDF says about itself.

    Attributes:
        line: title and source of the numbers.
        assumed: statements of what is assumed.
        inferred: statements of what was inferred from the geometry.
        posture: standing angles by joint name [rad]; empty where the file gives none.
    """

    line: str
    assumed: tuple[str, ...]
    posture: Mapping[str, float]
    inferred: tuple[str, ...] = ()


def read_provenance(file: UrdfFile) -> Provenance:
    """Read the <hexapod_pin> element; other parsers ignore it.

    Raises:
        UrdfError: a <posture> names no moved joint or has no finite angle.
    """
    element = file.root.find("hexapod_pin")
    if element is None:
        return Provenance(f"{file.name}: numbers of {file.source}", (), {})
    moved = {joint.name for joint in file.joints if joint.moves}
    posture, findings = {}, []
    for entry in element.findall("posture"):
        name, angle = entry.get("joint") or "", attribute(entry, "angle", math.nan)
        posture[name] = angle
        if name not in moved:
            findings.append(f"<posture>: no moved joint {name!r}")
        elif not math.isfinite(angle):
            findings.append(f"<posture> of joint {name!r}: angle {entry.get('angle')!r} rad")
    if findings:
        raise UrdfError(file.source, findings)
    assumed, inferred = (
        tuple((entry.text or "").strip() for entry in element.findall(tag))
        for tag in ("assumed", "inferred")
    )
    line = f"{file.name}: numbers of {file.source}"
    if element.get("title") is not None:
        line = f"{element.get('title')}. {element.get('source')}"
    return Provenance(line, assumed, posture, inferred)
