"""Mends of joint types, axes and couplings."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

from hexapod_pin.robot.description.urdf_file import JOINT_TYPES, Joint
from hexapod_pin.robot.mending import rules
from hexapod_pin.robot.mending.draft import Draft
from hexapod_pin.robot.mending.joint_findings import (
    AXIS_NORM_TOLERANCE,
    JOINT_TYPE_REMEDY,
    MADE_FIXED,
    bad_friction,
    joints_of_legs,
    unreadable_elements,
)


def mend_joints(draft: Draft) -> None:
    """Give every joint a type that is simulated, a unit axis, and no coupling."""
    for joint in draft.file.joints:
        _mend_type(draft, joint)
    _mend_continuous(draft)
    for joint in draft.file.joints:
        if joint.moves:
            _drop_coupling(draft, joint)
            _mend_axis(draft, joint)
    for joint in draft.file.joints:
        _mend_numbers(draft, joint)


def _mend_type(draft: Draft, joint: Joint) -> None:
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


def _mend_continuous(draft: Draft) -> None:
    """Make continuous joints of legs revolute; their range is assumed with other limits."""
    if "continuous" not in JOINT_TYPE_REMEDY:
        return
    legs = joints_of_legs(draft.measures)
    for joint in draft.file.joints:
        if joint.kind == "continuous" and joint.name in legs:
            limit = joint.element.find("limit")
            limit = ET.SubElement(joint.element, "limit") if limit is None else limit
            for name, value in (("lower", -rules.JOINT_RANGE), ("upper", rules.JOINT_RANGE)):
                limit.set(name, f"{value:g}")
            text = f"turns {-rules.JOINT_RANGE:g} to {rules.JOINT_RANGE:g} rad, not endlessly"
            _retype(draft, joint, "revolute", text)


def _mend_numbers(draft: Draft, joint: Joint) -> None:
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


def _mend_axis(draft: Draft, joint: Joint) -> None:
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
