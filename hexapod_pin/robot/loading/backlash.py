"""Backlash of gears: every joint that walks becomes a rotor's joint and a gap in series.

The rotor's joint has the name, range and drive of the old one; the gap turns freely by half of the
play to either side, against the joint's stops. The rotor's link is nearly massless: its inertia is
that of the motor, which `Motor.rotor_inertia` adds to the rotor's joint.
"""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.robot.description.urdf_file import TURNING, UrdfFile
from hexapod_pin.robot.recognition.layout import RobotLayout, annotate_urdf

GAP, ROTOR = "_backlash", "_rotor"
"""What the name of a joint is followed by in those of its gap and of its rotor's link."""

ROTOR_MASS, ROTOR_INERTIA = 1e-6, 1e-10
"""Of the rotor's link [kg, kg m^2]: none to speak of, as a moved body must have some."""

LARGEST_PLAY = 0.5
"""Largest play from edge to edge [rad]: 29 degrees."""

GAP_SPEED = 1e3
"""Rate limit of a gap [rad/s]: none."""


def with_backlash(
    file: UrdfFile, layout: RobotLayout, play: float | Mapping[str, float]
) -> tuple[UrdfFile, RobotLayout]:
    """Return a robot whose gears have free play: its annotated file and its layout.

    Args:
        file: annotated with the layout.
        layout: of it.
        play: from edge to edge, of all joints that walk, or by name of a joint that turns [rad].

    Raises:
        ParameterError: a play that is negative or beyond `LARGEST_PLAY`, or a name that is taken.
        UnknownNameError: no joint of that name turns.
    """
    turning = [joint.name for joint in file.joints if joint.moves and joint.kind in TURNING]
    walking = [x for leg in layout.legs for x in leg.joints if x in turning]
    plays = dict(play) if isinstance(play, Mapping) else dict.fromkeys(walking, play)
    for name, width in plays.items():
        if name not in turning:
            raise UnknownNameError("joint", name, turning)
        if not 0.0 <= width <= LARGEST_PLAY:
            allowed = f"0 to {LARGEST_PLAY:g} rad from edge to edge"
            raise ParameterError(f"LoadOptions.backlash[{name}]", width, allowed)
    taken = {*file.link_by_name, *(joint.name for joint in file.joints)}
    root, held = copy.deepcopy(file.root), dict(layout.held)
    for element in list(root.findall("joint")):
        name = element.get("name") or ""
        width = plays.get(name, 0.0)
        if width == 0.0:
            continue
        for made in (name + GAP, name + ROTOR):
            if made in taken:
                raise ParameterError("LoadOptions.backlash", made, "a name that no part has")
        _split(root, element, width)
        held[name + GAP] = 0.0
    text = ET.tostring(root, encoding="utf-8").decode()
    layout = replace(layout, turn=np.eye(3), held=held if layout.legs else {})
    return annotate_urdf(UrdfFile(file.source, text, root), layout), layout


def without_backlash(text: str, gaps: Mapping[str, str]) -> str:
    """Return the annotated text of a robot without the free play of its gears.

    Args:
        text: of one that `with_backlash` has made.
        gaps: as of `Robot.gaps`.
    """
    root = ET.fromstring(text)
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    links = {link.get("name"): link for link in root.findall("link")}
    for gap, name in gaps.items():
        behind, child = joints[gap].find("child"), joints[name].find("child")
        assert behind is not None and child is not None  # the robot is loaded
        child.set("link", behind.get("link") or "")
        root.remove(joints[gap])
        root.remove(links[name + ROTOR])
    for stated in list(root.iterfind("hexapod_pin")):
        for part in [part for part in stated if part.get("joint") in gaps]:
            stated.remove(part)
    return ET.tostring(root, encoding="unicode")


def _split(root: ET.Element, joint: ET.Element, play: float) -> None:
    """Put a rotor's link and a gap between a joint and its child."""
    name, child, axis = joint.get("name") or "", joint.find("child"), joint.find("axis")
    limit = joint.find("limit")
    assert child is not None  # the file has no findings
    link = ET.Element("link", name=name + ROTOR)
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "mass", value=repr(ROTOR_MASS))
    moments = {key: repr(ROTOR_INERTIA if key in ("ixx", "iyy", "izz") else 0.0)
               for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}  # fmt: skip
    ET.SubElement(inertial, "inertia", moments)
    gap = ET.Element("joint", name=name + GAP, type="revolute")
    ET.SubElement(gap, "parent", link=name + ROTOR)
    ET.SubElement(gap, "child", link=child.get("link") or "")
    if axis is not None:
        gap.append(copy.deepcopy(axis))
    effort = "0" if limit is None else limit.get("effort", "0")
    ET.SubElement(
        gap, "limit", lower=repr(-0.5 * play), upper=repr(0.5 * play), effort=effort,
        velocity=repr(GAP_SPEED),
    )  # fmt: skip
    child.set("link", name + ROTOR)
    place = list(root).index(joint)
    root.insert(place + 1, link)
    root.insert(place + 2, gap)
