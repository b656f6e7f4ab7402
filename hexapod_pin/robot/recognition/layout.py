"""A layout describes a robot in a URDF: its trunk, legs, feet and standing posture.

A `RobotLayout` comes from the <hexapod_pin> element, from joint names that follow a known
convention, or from `recognise`. `annotate_urdf` writes it into the element, so that the
text alone gives the same robot.
"""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import UnknownNameError, UrdfError
from hexapod_pin.robot.description.leg_names import LEG_NAMES, leg_of_chain
from hexapod_pin.robot.description.urdf_annotation import (
    ANNOTATION,
    StatedLeg,
    moved_joints_above,
    stated_leg_faults,
    stated_legs,
    stated_places,
)
from hexapod_pin.robot.description.urdf_file import POINT, TURNING, Joint, UrdfFile
from hexapod_pin.robot.description.urdf_writer import number, numbers
from hexapod_pin.robot.rotations import roll_pitch_yaw
from hexapod_pin.robot.state import joint_angles
from hexapod_pin.spec import Spec

Names = tuple[str, ...]


class RobotHints(Spec):
    """Overrides of what would be inferred; None leaves it to be inferred.

    Attributes:
        forward: direction of travel in the root link's frame: "x", "-y", ... or an angle about the
            trunk's upward axis from the root link's x axis [degrees].
        legs: leg name -> its joints from the trunk outwards, or one joint or link of it.
        feet: foot links, one per leg.
        foot_radius: of all foot spheres [m].
        posture: standing angles by joint name, or in joint order [rad].
        held: places of joints that do not walk, by name [rad or m].
    """

    forward: float | str | None = None
    legs: dict[str, Names] | None = None
    feet: Names | None = None
    foot_radius: float | None = None
    posture: dict[str, float] | tuple[float, ...] | None = None
    held: dict[str, float] | None = None


@dataclass(frozen=True, eq=False)
class LegLayout:
    """One leg as it is found.

    Attributes:
        name: of the leg: lf, lm, lr, rf, rm, rr where there are six.
        joints: the joints that walk, from the trunk outwards. Two or three.
        held: other moved joints between the trunk and the foot; their angles are fixed.
        tip_link: the link that carries the foot.
        foot: name of the foot link; a new one where no link of the file is the foot.
        centre: centre of the foot sphere in the frame of `tip_link` [m]. Shape (3,).
        radius: of that sphere [m]; 0 is a point.
    """

    name: str
    joints: Names
    held: Names
    tip_link: str
    foot: str
    centre: Array
    radius: float


@dataclass(frozen=True, eq=False)
class RobotLayout:
    """The robot in a URDF.

    Attributes:
        turn: the trunk's axes in the frame of the root link: columns forward, left, up. (3, 3).
        legs: in the order of `leg_names`, or as the file states them.
        held: every moved joint that does not walk (head, arm, surplus leg joint, foot spring) with
            the place where it is held [rad or m].
        posture: standing angle of every joint that walks [rad].
        inferred: a sentence on each inference; empty where the file states everything.
        feet: foot links of a robot without legs to walk with.
        caution: what speaks against a direction that the user gives, or against the names of
            legs; empty where nothing does.
        doubt: what speaks against its left and right legs as a whole; mostly empty.
    """

    turn: Array
    legs: tuple[LegLayout, ...]
    held: Mapping[str, float] = field(default_factory=dict)
    posture: Mapping[str, float] = field(default_factory=dict)
    inferred: Names = ()
    feet: Names = ()
    caution: str = ""
    doubt: str = ""


# The standing posture that a file states; the user's hints go before it.


def known_posture(file: UrdfFile, hints: RobotHints) -> dict[str, float]:
    """Return the angles [rad] that the user or the file states, by joint name.

    Raises:
        UnknownNameError: a joint that does not exist.
        StateError: a sequence of another length, or values that are not finite.
        UrdfError: a <posture> that names no moved joint or has no finite angle.
    """
    own, given = stated_places(file, "posture"), hints.posture
    if given is None:
        return own
    names = joint_order(file)
    angles = joint_angles(names, np.zeros(len(names)), given).tolist()
    if isinstance(given, Mapping):
        return {**own, **{name: float(angle) + 0.0 for name, angle in given.items()}}
    return {name: angle + 0.0 for name, angle in zip(names, angles, strict=True)}


def known_places(file: UrdfFile, hints: RobotHints) -> dict[str, float]:
    """Return where the user or the file states that joints are held, by name [rad or m].

    Raises:
        UnknownNameError: a joint that does not exist.
        UrdfError: a <held> that names no moved joint or has no finite place.
    """
    own = stated_places(file, "held")
    moved = [joint.name for joint in file.joints if joint.moves]
    for name in hints.held or {}:
        if name not in moved:
            raise UnknownNameError("moved joint", name, moved)
    return own | {name: float(place) + 0.0 for name, place in (hints.held or {}).items()}


def joint_order(file: UrdfFile) -> list[str]:
    """Return the moved joints in the order of the loaded robot: depth first, siblings by name."""
    order, stack = [], [file.base]
    while stack:
        item = stack.pop()
        below = sorted(file.joints_below[item], key=lambda joint: joint.name, reverse=True)
        stack += [joint.child for joint in below]
        order.append(item)
    carriers = {joint.child: joint for joint in file.joints}
    return [carriers[n].name for n in order if n in carriers and carriers[n].moves]


def held_place(joint: Joint, held: Mapping[str, float]) -> float:
    """Return where a joint is held: as requested, else zero moved into its limits [rad or m]."""
    if joint.name in held:
        return float(held[joint.name])
    lower, upper = joint.limit("lower", 0.0), joint.limit("upper", 0.0)
    bounded = joint.kind != "continuous" and np.isfinite([lower, upper]).all() and lower <= upper
    return float(min(max(0.0, lower), upper)) if bounded else 0.0


# Layouts that need no recognition: those stated by the file and those given by joint names.

FOOT_WORDS = ("foot", "tip", "tarsus")
"""A foot link has one of these in its name; an earlier word has priority."""

NO_HINTS = RobotHints()


def layout_stated(file: UrdfFile, hints: RobotHints = NO_HINTS) -> RobotLayout | None:
    """Return the robot as its file states it; None where it states no legs.

    Args:
        file: a URDF; its root link has x forward, y left, z up.
        hints: feet that the user gives must be the stated ones; `forward` and `legs` are not read.

    Raises:
        UrdfError: an element names what does not exist or no chain from the trunk to the foot, a
            joint serves twice, the count is not 4 to 8, or other feet are given; all at once.
    """
    legs = stated_legs(file)
    if not legs:
        return None
    findings, stated = stated_leg_faults(file), [foot for _, _, foot in legs]
    if hints.feet is not None and sorted(hints.feet) != sorted(stated):
        findings.append(f"feet {list(hints.feet)}: the file states {stated}; give these, or none")
    if findings:
        raise UrdfError(file.source, findings)
    return _known_layout(file, legs, hints)


def layout_named(file: UrdfFile, hints: RobotHints = NO_HINTS) -> RobotLayout | None:
    """Return six legs of three joints whose names follow a known convention; None for other robots.

    The feet are those that the user gives, else links at the legs' ends with a foot's name.
    """
    chains: dict[str | None, tuple[Names, str]] = {}
    for first in file.moved_joints_below(file.base):
        joints = [first]
        while len(below := file.moved_joints_below(joints[-1].child)) == 1:
            joints += below
        names = tuple(joint.name for joint in joints)
        if len(joints) == 3 and not below and all(joint.kind in TURNING for joint in joints):
            chains[leg_of_chain((names[0], names[1], names[2]))] = names, joints[-1].child
    if set(chains) != {*LEG_NAMES} or sum(joint.moves for joint in file.joints) != 18:
        return None
    legs: list[StatedLeg] = []
    for name in LEG_NAMES:
        joints_of_leg, last = chains[name]
        foot = named_foot(file, last)
        if hints.feet is not None:
            given = [link for link in file.rigid_group(last) if link in hints.feet]
            foot = given[0] if len(given) == 1 else None
        if foot is None:
            return None
        legs.append((name, joints_of_leg, foot))
    return _known_layout(file, legs, hints)


def _known_layout(file: UrdfFile, legs: Sequence[StatedLeg], hints: RobotHints) -> RobotLayout:
    """Return the layout of legs that need not be searched.

    A foot is its link's first collision sphere, else a point.
    """
    held = known_places(file, hints)
    walking = {joint for _, joints, _ in legs for joint in joints}
    places = {
        joint.name: held_place(joint, held)
        for joint in file.joints
        if joint.moves and joint.name not in walking
    }
    layouts = []
    for name, joints, foot in legs:
        beside = [joint.name for joint in moved_joints_above(file, foot) if joint.name in places]
        sphere = file.foot_sphere(foot) or POINT
        radius = sphere.radius if hints.foot_radius is None else float(hints.foot_radius)
        centre = read_only(sphere.centre)
        layouts.append(LegLayout(name, joints, tuple(beside), foot, foot, centre, radius))
    posture = {x: angle for x, angle in known_posture(file, hints).items() if x in walking}
    return RobotLayout(read_only(np.eye(3)), tuple(layouts), places, posture)


def layout_of_feet(file: UrdfFile, hints: RobotHints) -> RobotLayout:
    """Return the layout of a robot that can stand on the feet the user gives, without legs.

    Raises:
        UnknownNameError: a foot that is no link.
        UrdfError: no feet, or one of them twice.
    """
    feet = hints.feet or ()
    for name in feet:
        if name not in file.link_by_name:
            raise UnknownNameError("foot link", name, list(file.link_by_name))
    twice = sorted({name for name in feet if feet.count(name) > 1})
    if twice or not feet:
        what = f"{', '.join(twice)} given twice" if twice else "is empty"
        raise UrdfError(file.source, [f"feet=[...] {what}: give each foot link once"])
    posture, held = known_posture(file, hints), known_places(file, hints)
    return RobotLayout(read_only(np.eye(3)), (), held, posture, feet=feet)


def foot_word(name: str) -> int | None:
    """Return the rank of the word for a foot in a link's name; None where it has none."""
    return next((k for k, word in enumerate(FOOT_WORDS) if word in name.lower()), None)


def named_foot(file: UrdfFile, link: str) -> str | None:
    """Return the link fixed to a leg's last one whose name has the earliest of FOOT_WORDS."""
    fixed = file.rigid_group(link)[1:]
    ranked = [(foot_word(name), -k, name) for k, name in enumerate(fixed)]
    return min(((r, k, n) for r, k, n in ranked if r is not None), default=(0, 0, None))[2]


# A layout in a URDF's text.
#
# The trunk's axes become those of a new root link without mass, feet that no link marks become
# links with a sphere, and the annotation states legs, posture, held joints and what was inferred.

TRUNK_LINK = "trunk_axes"
"""Name of the root link that turns the trunk: x forward, y left, z up."""


def annotate_urdf(file: UrdfFile, layout: RobotLayout) -> UrdfFile:
    """Return the file with its layout stated; the file itself where its text already gives it.

    Args:
        file: a URDF without findings.
        layout: what was found in it.
    """
    if not layout.legs or (not layout.inferred and _states(file, layout)):
        return file
    root = copy.deepcopy(file.root)
    known = {x.get("name") or "" for tag in ("link", "joint") for x in root.iter(tag)}
    for leg in layout.legs:
        if leg.foot not in file.link_by_name:
            _add_foot(root, leg, known)
    if not np.array_equal(layout.turn, np.eye(3)):
        _turn_trunk(root, file.base, layout.turn, known)
    _write_layout(root, layout)
    ET.indent(root)
    text = ET.tostring(root, encoding="utf-8").decode()
    return UrdfFile(file.source, text, root)


def _states(file: UrdfFile, layout: RobotLayout) -> bool:
    """Return whether a file's text alone gives the trunk and the legs of a layout."""
    own = layout_stated(file) or layout_named(file)
    if own is None or not np.array_equal(layout.turn, own.turn):
        return False
    one, other = ({leg.name: (leg.joints, leg.foot) for leg in x.legs} for x in (own, layout))
    return one == other


def _add_foot(root: ET.Element, leg: LegLayout, known: set[str]) -> None:
    """Add a foot link with its sphere, fixed to the link that carries it."""
    foot = ET.SubElement(root, "link", name=leg.foot)
    if leg.radius > 0.0:
        shape = ET.SubElement(ET.SubElement(foot, "collision"), "geometry")
        ET.SubElement(shape, "sphere", radius=number(leg.radius))
    _fix(root, leg.tip_link, leg.foot, leg.centre, np.eye(3), known)


def _turn_trunk(root: ET.Element, base: str, turn: Array, known: set[str]) -> None:
    """Make a new root link in the trunk's axes and fix the old one to it."""
    name = free_name(TRUNK_LINK, known)
    root.insert(0, ET.Element("link", name=name))
    _fix(root, name, base, np.zeros(3), turn.T, known)


def _fix(
    root: ET.Element, parent: str, child: str, place: Array, turn: Array, known: set[str]
) -> None:
    joint = ET.SubElement(root, "joint", name=free_name(f"{child}_fixed", known), type="fixed")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(
        joint, "origin", xyz=numbers(place.tolist()), rpy=numbers(roll_pitch_yaw(turn).tolist())
    )


def free_name(name: str, known: set[str]) -> str:
    """Return a name that is not in `known`, with underscores appended as needed, and add it."""
    while name in known:
        name += "_"
    known.add(name)
    return name


def _write_layout(root: ET.Element, layout: RobotLayout) -> None:
    """Write legs, posture, held joints and what was inferred into the file's annotation."""
    element = root.find(ANNOTATION)
    if element is None:
        element = ET.Element(ANNOTATION)
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
