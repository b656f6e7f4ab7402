"""Faults of a joint's type, place, axis and coupling are found and repaired."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Container, Iterator

from hexapod_pin.robot.description.urdf_file import JOINT_TYPES, Joint, attribute
from hexapod_pin.robot.repair import rules
from hexapod_pin.robot.repair.finding import Draft, Finding
from hexapod_pin.robot.repair.measures import Measures

AXIS_NORM_TOLERANCE = 1e-6
"""An axis shorter than this is zero; one off unit length by more is normalised with a note."""

RESERVED_NAMES = ("root_joint", "universe")
"""Names of the floating base's joint and of the ground in Pinocchio's models."""

JOINT_TYPE_REMEDY = {
    "continuous": "in a leg: revolute, with lower and upper limits",
    "planar": "not simulated; use revolute or fixed joints",
    "floating": "only the base floats, without a joint in the file; remove it or make it fixed",
}
"""Remedies for the types that are not simulated."""

ALONE = "make it revolute or fixed: one joint alone is a wheel"
"""Way out of an endless joint that is in no leg."""

FRICTION_UNITS = {
    "revolute": {"damping": "N m s/rad", "friction": "N m"},
    "prismatic": {"damping": "N s/m", "friction": "N"},
}
"""Units of damping and friction by type of joint; of other types they do not count."""

NUMBERS = {
    "limit": (("lower", "upper", "effort", "velocity"), ("effort", "velocity")),
    "dynamics": (("damping", "friction"), ()),
    "mimic": (("multiplier", "offset"), ("joint",)),
    "calibration": (("rising", "falling"), ()),
    "safety_controller": (
        ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
        ("k_velocity",),
    ),
}
"""Numbers of the elements of a joint, and the attributes without which urdfdom refuses them."""

MADE_FIXED = ("planar", "floating")
"""Types that a repair makes fixed."""

FEWEST_JOINTS = 2
"""A chain of fewer moved joints is a wheel, not a leg."""

REPAIR_OF_TYPE = {
    "continuous": "revolute with assumed limits",
    "planar": "made fixed where it is at zero",
    "floating": "dropped with the link above it if that is an empty root, else made fixed",
}


def joint_findings(measures: Measures) -> list[Finding]:
    """Return every trouble of types, places, axes and couplings."""
    legs = joints_of_legs(measures)
    return [found for joint in measures.file.joints for found in _of_joint(joint, legs)]


def joints_of_legs(measures: Measures) -> set[str]:
    """Return the names of the joints in chains of several that stay moved: others are wheels."""
    moved = [[j.name for j in chain if j.kind not in MADE_FIXED] for chain in measures.chains]
    return {name for names in moved if len(names) >= FEWEST_JOINTS for name in names}


def _of_joint(joint: Joint, legs: Container[str]) -> Iterator[Finding]:
    where = f"joint {joint.name!r}"
    if not all(map(math.isfinite, joint.xyz + joint.rpy)):
        yield Finding.of("unreadable origin", where, f"origin {_written(joint)}")
    yield from _numbers(joint, where)
    if joint.kind not in JOINT_TYPES:
        yield Finding.of("unknown joint type", where, f"unknown type {joint.kind!r}")
        return
    if joint.moves:
        yield from _of_moved(joint, where, legs)


def _of_moved(joint: Joint, where: str, legs: Container[str]) -> Iterator[Finding]:
    if joint.kind in JOINT_TYPE_REMEDY:
        wheel = joint.kind == "continuous" and joint.name not in legs
        yield Finding(
            f"{joint.kind} joint",
            where,
            f"type {joint.kind}",
            JOINT_TYPE_REMEDY[joint.kind],
            ALONE if wheel else REPAIR_OF_TYPE[joint.kind],
            repairable=not wheel,
        )
    if joint.name in RESERVED_NAMES:
        yield Finding(
            "reserved name",
            where,
            "this name is reserved for the floating base or the ground",
            "another name",
            "renamed",
        )
    if joint.element.find("mimic") is not None:
        yield Finding.of("coupled joint", where, "<mimic>")
    norm, axis = math.hypot(*joint.axis), " ".join(f"{value:g}" for value in joint.axis)
    if joint.kind == "floating":
        return
    if not norm >= AXIS_NORM_TOLERANCE or not math.isfinite(norm):
        yield Finding.of("zero axis", where, f"axis {axis} has length {norm:g}")
    elif abs(norm - 1) > AXIS_NORM_TOLERANCE:
        yield Finding.of("axis not of unit length", where, f"axis {axis}")


def _numbers(joint: Joint, where: str) -> Iterator[Finding]:
    """Yield numbers that cannot be read, also of joints that do not move: parsers refuse them."""
    for name, unit in bad_friction(joint):
        yield Finding(
            f"bad {name}",
            where,
            f"{name} {joint.dynamics(name):g} {unit}",
            "must be finite and at least 0",
            "set to 0",
        )
    for element in unreadable_elements(joint):
        attributes = ", ".join(f"{name} {value!r}" for name, value in element.attrib.items())
        yield Finding.of(
            "unreadable element", where, f"<{element.tag}> with {attributes or 'no attribute'}"
        )


def bad_friction(joint: Joint) -> list[tuple[str, str]]:
    """Return name and unit of damping and friction that a simulated joint cannot have."""
    names = FRICTION_UNITS.get(joint.kind, {}).items()
    return [(x, unit) for x, unit in names if not 0.0 <= joint.dynamics(x) < math.inf]


def unreadable_elements(joint: Joint) -> list[ET.Element]:
    """Return elements of a joint that do not count and have numbers that cannot be read."""
    found = (joint.element.find(tag) for tag in NUMBERS)
    return [x for x in found if x is not None and not _readable(joint, x)]


def _readable(joint: Joint, element: ET.Element) -> bool:
    if joint.kind in FRICTION_UNITS and element.tag in ("limit", "mimic"):
        return True  # judged by other rules
    numbers, needed = NUMBERS[element.tag]
    if joint.kind in FRICTION_UNITS and element.tag == "dynamics":
        return any(name in element.attrib for name in numbers)
    finite = all(math.isfinite(attribute(element, name, 0.0)) for name in numbers)
    some = element.tag != "dynamics" or any(name in element.attrib for name in numbers)
    return finite and some and all(name in element.attrib for name in needed)


def _written(joint: Joint) -> str:
    """Return the numbers of a joint's origin as they are written."""
    found = joint.element.find("origin")
    names = ("xyz", "rpy")
    return ", ".join(f"{x} {found.get(x)!r}" for x in names if found is not None and found.get(x))


# Repairs of joint types, axes and couplings.


def repair_joints(draft: Draft) -> None:
    """Give every joint a type that is simulated, a unit axis, and no coupling."""
    for joint in draft.file.joints:
        _repair_type(draft, joint)
    _repair_continuous(draft)
    for joint in draft.file.joints:
        if joint.moves:
            _drop_coupling(draft, joint)
            _repair_axis(draft, joint)
    for joint in draft.file.joints:
        _repair_numbers(draft, joint)


def _repair_type(draft: Draft, joint: Joint) -> None:
    kind, where = joint.kind, f"joint {joint.name!r}"
    if kind not in JOINT_TYPES:
        known = kind.strip().lower()
        turns = all(joint.element.find(tag) is not None for tag in ("limit", "axis"))
        new = known if known in JOINT_TYPES else "revolute" if turns else "fixed"
        assumed = "" if new == known else f"is {new}: its type {kind!r} is none"
        _retype(draft, joint, new, assumed)
    elif kind in MADE_FIXED:
        _retype(draft, joint, "fixed", f"is fixed: type {kind} is not simulated")
        draft.change(where, "its limits, axis and friction no longer count")


def _repair_continuous(draft: Draft) -> None:
    """Make continuous joints of legs revolute; their range is assumed with other limits."""
    legs = joints_of_legs(draft.measures)
    for joint in draft.file.joints:
        if joint.kind == "continuous" and joint.name in legs:
            limit = joint.element.find("limit")
            limit = ET.SubElement(joint.element, "limit") if limit is None else limit
            for name, value in (("lower", -rules.JOINT_RANGE), ("upper", rules.JOINT_RANGE)):
                limit.set(name, f"{value:g}")
            text = f"turns {-rules.JOINT_RANGE:g} to {rules.JOINT_RANGE:g} rad, not endlessly"
            _retype(draft, joint, "revolute", text)


def _repair_numbers(draft: Draft, joint: Joint) -> None:
    where = f"joint {joint.name!r}"
    for name, unit in bad_friction(joint):
        dynamics = joint.element.find("dynamics")
        if dynamics is not None:
            text = f"{name} {dynamics.get(name)!r} -> 0 {unit}"
            dynamics.set(name, "0")
            draft.change(where, text, f"no {name}")
    for element in unreadable_elements(joint):
        joint.element.remove(element)
        draft.change(where, f"<{element.tag}> dropped: it has missing or non-finite numbers")


def _retype(draft: Draft, joint: Joint, new: str, assumed: str) -> None:
    joint.element.set("type", new)
    draft.change(f"joint {joint.name!r}", f"type {joint.kind} -> {new}", assumed)


def _drop_coupling(draft: Draft, joint: Joint) -> None:
    mimic = joint.element.find("mimic")
    if mimic is not None:
        joint.element.remove(mimic)
        text = f"<mimic> of joint {mimic.get('joint')!r} dropped"
        draft.change(f"joint {joint.name!r}", text, "moves by itself, not coupled to another")


def _repair_axis(draft: Draft, joint: Joint) -> None:
    norm = math.hypot(*joint.axis)
    if not norm >= AXIS_NORM_TOLERANCE or not math.isfinite(norm):
        joint.element.set("type", "fixed")
        written = joint.element.find("axis")
        value = None if written is None else written.get("xyz")
        draft.change(
            f"joint {joint.name!r}",
            f"axis {value!r}: {joint.kind} -> fixed",
            "is fixed: its axis has no direction",
        )
    elif abs(norm - 1.0) > AXIS_NORM_TOLERANCE:
        axis = joint.element.find("axis")
        if axis is not None:
            before = axis.get("xyz")
            axis.set("xyz", " ".join(f"{value / norm:.12g}" for value in joint.axis))
            draft.change(f"joint {joint.name!r}", f"axis {before} -> {axis.get('xyz')}")
