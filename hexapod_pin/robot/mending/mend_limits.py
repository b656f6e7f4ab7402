"""Repairs of ranges, torque limits and speed limits."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from hexapod_pin.robot.description.urdf_file import Joint
from hexapod_pin.robot.mending import rules
from hexapod_pin.robot.mending.draft import Draft
from hexapod_pin.robot.mending.limit_findings import (
    UNITS,
    effort_trouble,
    is_held,
    limited,
    range_trouble,
    velocity_trouble,
)
from hexapod_pin.robot.mending.measures import Measures


def mend_limits(draft: Draft) -> None:
    """Give every joint a range, a torque limit and a speed limit that a servo can have."""
    measures = draft.measures
    for joint in measures.file.joints:
        if limited(joint):
            limit = joint.element.find("limit")
            if limit is None:
                limit = ET.SubElement(joint.element, "limit")
            _mend_range(draft, joint, limit)  # once swapped, it may be above a turn
            _mend_range(draft, joint, limit)
            _mend_effort(draft, measures, joint, limit)
            _mend_velocity(draft, joint, limit)


def _mend_range(draft: Draft, joint: Joint, limit: ET.Element) -> None:
    trouble = range_trouble(joint)
    if trouble is None or is_held(joint):
        return
    before = f"{limit.get('lower')} to {limit.get('upper')}"
    unit = UNITS[joint.kind][0]
    if trouble[0] == "reversed limits":
        lower, upper = limit.get("upper", "0"), limit.get("lower", "0")
        assumed = ""
    else:
        half = rules.JOINT_RANGE if joint.kind == "revolute" else 0.0
        lower, upper = f"{-half:g}", f"{half:g}"
        assumed = f"range {lower} to {upper} {unit}, where the file gives none"
    limit.set("lower", lower)
    limit.set("upper", upper)
    text = f"limits {before} -> {lower} to {upper} {unit}"
    draft.change(f"joint {joint.name!r}", text, assumed)


def _mend_effort(draft: Draft, measures: Measures, joint: Joint, limit: ET.Element) -> None:
    given, unit = draft.options.effort, UNITS[joint.kind][1]
    before = limit.get("effort")
    if given is not None and joint.kind == "revolute":
        new, assumed = given, ""
    elif effort_trouble(measures, joint) and joint.kind == "revolute":
        new = measures.assumed_effort
        if new <= 0.0:
            return
        assumed = (
            f"torque limit {new:g} N m: {rules.TORQUE_FACTOR:g} times the static torque of a third"
            f" of {measures.total_mass:.4g} kg at half a leg of {measures.leg_length:.3g} m"
        )
    elif effort_trouble(measures, joint):
        new = two_weights(measures)
        assumed = f"force limit {new:g} N: twice the weight"
    else:
        return
    _set(draft, joint, limit, "effort", before, new, unit, assumed)


def two_weights(measures: Measures) -> float:
    """Return twice the robot's weight [N], the force limit of a sliding joint without one."""
    return float(f"{2.0 * rules.GRAVITY * measures.total_mass:.2g}")


def _mend_velocity(draft: Draft, joint: Joint, limit: ET.Element) -> None:
    given, unit = draft.options.velocity, UNITS[joint.kind][2]
    if given is not None and joint.kind == "revolute":
        new, assumed = given, ""
    elif velocity_trouble(joint):
        new = rules.SPEED if joint.kind == "revolute" else 1.0
        assumed = f"speed limit {new:g} {unit}" + (
            ": the median no-load speed of servos is 6.2 rad/s" if unit == "rad/s" else ""
        )
    else:
        return
    _set(draft, joint, limit, "velocity", limit.get("velocity"), new, unit, assumed)


def _set(
    draft: Draft,
    joint: Joint,
    limit: ET.Element,
    name: str,
    before: str | None,
    new: float,
    unit: str,
    assumed: str,
) -> None:
    if before is not None and joint.limit(name) == new:
        return
    limit.set(name, f"{new:g}")
    draft.change(f"joint {joint.name!r}", f"{name} {before} -> {new:g} {unit}", assumed)
