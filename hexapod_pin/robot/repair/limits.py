"""Faults of the limits, effort, velocity and friction of joints are found and repaired."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence

from hexapod_pin.robot.description.urdf_file import Joint
from hexapod_pin.robot.repair import rules
from hexapod_pin.robot.repair.doubts import NARROW, RESISTANCE
from hexapod_pin.robot.repair.finding import Draft, Finding
from hexapod_pin.robot.repair.measures import Measures
from hexapod_pin.robot.repair.rules import Severity

REPAIR_RANGE = {
    "revolute": f"assumed: {-rules.JOINT_RANGE:g} to {rules.JOINT_RANGE:g} rad",
    "prismatic": "assumed: 0 to 0 m, so that it is held",
}
GIVE_RANGE = "give the range of its travel: the file does not contain it"
GIVE_EFFORT = "give effort: the length of the legs is not known; --effort"
REPAIR_EFFORT = "assumed from weight and leg length; --effort"
REPAIR_SPEED = f"assumed: {rules.SPEED:g} rad/s; --velocity"
UNITS = {"revolute": ("rad", "N m", "rad/s"), "prismatic": ("m", "N", "m/s")}


def limit_findings(measures: Measures) -> list[Finding]:
    """Return every trouble of limits, effort, velocity and friction."""
    joints = [j for j in measures.file.joints if limited(j)]
    slip = limits_in_degrees(joints)
    found = [one for one in (slip, narrow_limits(measures, joints)) if one is not None]
    found += [found for joint in joints for found in _of_joint(measures, joint)]
    return found + [found for joint in joints for found in _resistance(measures, joint)]


def _resistance(measures: Measures, joint: Joint) -> Iterator[Finding]:
    """Yield that damping or friction of a joint is above what standing takes."""
    holding = measures.holding_torque if measures.plausible_mass else 0.0
    if joint.kind != "revolute" or holding <= 0.0:
        return
    speed = min(rules.SPEED, joint.limit("velocity", rules.SPEED) or rules.SPEED)
    for name, unit, torque, at in (
        ("damping", "N m s/rad", speed * joint.dynamics("damping"), f" at {speed:.3g} rad/s"),
        ("friction", "N m", joint.dynamics("friction"), ""),
    ):
        if torque > rules.RESISTANCE * holding:
            value = f"{name} {joint.dynamics(name):.3g} {unit}"
            took = f" takes {torque:.2g} N m{at}" if at else ""
            yield Finding(
                RESISTANCE, f"joint {joint.name!r}", f"{value}{took}, standing {holding:.2g} N m",
                "less than standing on three feet takes", "check its unit by hand", "suspicious",
                repairable=False,
            )  # fmt: skip


def limits_in_degrees(joints: Sequence[Joint]) -> Finding | None:
    """Return the finding of limits that are in degrees: of most joints they allow many turns."""
    turning = [joint for joint in joints if joint.kind == "revolute"]
    wide = [joint for joint in turning if _is_in_degrees(joint)]
    if not turning or 2 * len(wide) <= len(turning):
        return None
    joint = wide[0]
    value = f"limits {joint.limit('lower', 0.0):g} to {joint.limit('upper', 0.0):g} rad"
    rule = "at most one turn, 6.28 rad, apart"
    where = f"joint {joint.name!r} and {len(wide) - 1} more"
    return Finding("limits in degrees", where, value, rule, "turned into radians", "suspicious")


def narrow_limits(measures: Measures, joints: Sequence[Joint]) -> Finding | None:
    """Return the finding of limits that were turned from degrees into radians, being radians.

    Then no joint turns by more than a turn over 57.3, where legs need half a radian at least.
    """
    walking = {joint.name for chain in measures.chains for joint in chain}
    turning = [joint for joint in joints if joint.kind == "revolute" and joint.name in walking]
    ranges = [joint.limit("upper", 0.0) - joint.limit("lower", 0.0) for joint in turning]
    most = max(ranges, default=0.0)
    if len(ranges) < rules.FEWEST_NARROW or not 0.0 < most <= math.radians(rules.FULL_TURN):
        return None
    value = f"no joint turns by more than {most:.2g} rad"
    rule = f"legs need half a radian; {most:.2g} rad are {math.degrees(most):.3g} degrees"
    repair = "multiplied by 57.3: radians were read as degrees"
    return Finding(NARROW, "robot", value, rule, repair, "suspicious")


def _is_in_degrees(joint: Joint) -> bool:
    """Whether a range is wider than a turn, with ends that are usual in degrees."""
    ends = abs(joint.limit("lower", 0.0)), abs(joint.limit("upper", 0.0))
    low, high = rules.DEGREES
    return joint.kind == "revolute" and sum(ends) > rules.FULL_TURN and low <= max(ends) <= high


def limited(joint: Joint) -> bool:
    """Whether a joint is simulated and needs limits."""
    return joint.kind in UNITS


def range_trouble(joint: Joint) -> tuple[str, str, bool] | None:
    """Return kind and value of what is wrong with the range, and whether it refuses the file."""
    lower, upper = joint.limit("lower", 0.0), joint.limit("upper", 0.0)
    unit = UNITS[joint.kind][0]
    if not (math.isfinite(lower) and math.isfinite(upper)):
        return "unreadable limits", f"limits {lower:g} to {upper:g} {unit}", True
    if lower > upper:
        text = f"lower limit {lower:g} {unit} is above the upper limit {upper:g} {unit}"
        return "reversed limits", text, True
    if lower == upper:
        return "no range", f"limits {lower:g} to {upper:g} {unit}", False
    if joint.kind == "revolute" and upper - lower > rules.FULL_TURN:
        return "range above a turn", f"limits {lower:g} to {upper:g} rad", False
    return None


def is_held(joint: Joint) -> bool:
    """Whether a sliding joint has a range of 0: it is held there, as no other range is known."""
    return joint.kind == "prismatic" and joint.limit("lower", 0.0) == joint.limit("upper", 0.0)


def effort_trouble(measures: Measures, joint: Joint) -> tuple[str, bool] | None:
    """Return what is wrong with the torque limit, and whether it refuses the file."""
    effort = joint.limit("effort")
    if not (effort >= 0.0 and math.isfinite(effort)):
        return "unreadable effort", not effort >= 0.0
    if effort == 0.0:
        return "zero effort", False
    lift = lifting_torque(measures)
    if joint.kind != "revolute" or lift <= 0.0:
        return None
    low, high = rules.TORQUES
    if effort > high * lift:
        return "absurd effort", False
    return ("weak effort", False) if effort < low * lift else None


def velocity_trouble(joint: Joint) -> tuple[str, bool] | None:
    """Return what is wrong with the speed limit, and whether it refuses the file."""
    velocity = joint.limit("velocity")
    if not 0.0 < velocity < math.inf:
        return ("zero velocity" if velocity == 0.0 else "unreadable velocity"), True
    if joint.kind != "revolute":
        return None
    low, high = rules.SPEEDS
    if velocity > high:
        return "absurd velocity", False
    return ("slow velocity", False) if velocity < low else None


def lifting_torque(measures: Measures) -> float:
    """Return weight times the length of a stretched leg [N m]; 0 where the mass is absurd."""
    if not measures.plausible_mass:
        return 0.0
    return rules.GRAVITY * measures.total_mass * measures.leg_length


def _of_joint(measures: Measures, joint: Joint) -> Iterator[Finding]:
    where = f"joint {joint.name!r}"
    unit, torque_unit, speed_unit = UNITS[joint.kind]
    if joint.element.find("limit") is None:
        yield Finding(
            "no limits",
            where,
            "no <limit>",
            "give lower, upper, effort and velocity",
            f"{REPAIR_RANGE[joint.kind]}; effort and velocity {REPAIR_EFFORT}, --velocity",
        )
        return
    if trouble := range_trouble(joint):
        rule = "must be finite, lower below upper" + (
            ", at most one turn apart" if unit == "rad" else ""
        )
        repair = "swapped" if trouble[0] == "reversed limits" else REPAIR_RANGE[joint.kind]
        held = is_held(joint)
        repair, severity = GIVE_RANGE if held else repair, _severity(trouble[2])
        yield Finding(trouble[0], where, trouble[1], rule, repair, severity, repairable=not held)
    if bad := effort_trouble(measures, joint):
        value, rule = f"effort {joint.limit('effort'):g} {torque_unit}", _effort_rule(measures)
        known = joint.kind == "prismatic" or measures.leg_length > 0.0
        repair, severity = REPAIR_EFFORT if known else GIVE_EFFORT, _severity(bad[1])
        yield Finding(bad[0], where, value, rule, repair, severity, repairable=known)
    if bad := velocity_trouble(joint):
        value = f"velocity {joint.limit('velocity'):g} {speed_unit}"
        low, high = rules.SPEEDS
        rule = f"must be above 0; {low:g} to {high:g} rad/s is usual"
        yield Finding(bad[0], where, value, rule, REPAIR_SPEED, _severity(bad[1]))


def _effort_rule(measures: Measures) -> str:
    lift = lifting_torque(measures)
    if lift <= 0.0:
        return "must be finite and above 0"
    low, high = rules.TORQUES
    return (
        f"must be finite and above 0; {low * lift:.2g} to {high * lift:.2g} N m is plausible for"
        f" {measures.total_mass:.3g} kg on legs of {measures.leg_length:.2g} m"
    )


def _severity(refused: bool) -> Severity:
    return "refused" if refused else "suspicious"


# Repairs of ranges, torque limits and speed limits.


def repair_limits(draft: Draft) -> None:
    """Give every joint a range, a torque limit and a speed limit that a servo can have."""
    measures = draft.measures
    degrees = limits_in_degrees([joint for joint in measures.file.joints if limited(joint)])
    narrow = narrow_limits(measures, [joint for joint in measures.file.joints if limited(joint)])
    for joint in measures.file.joints:
        if limited(joint):
            if degrees is not None and _is_in_degrees(joint):
                _repair_degrees(draft, joint, math.radians(1.0))
            if narrow is not None and joint.kind == "revolute":
                _repair_degrees(draft, joint, math.degrees(1.0))
            limit = joint.element.find("limit")
            if limit is None:
                limit = ET.SubElement(joint.element, "limit")
            _repair_range(draft, joint, limit)  # once swapped, it may be above a turn
            _repair_range(draft, joint, limit)
            _repair_effort(draft, measures, joint, limit)
            _repair_velocity(draft, joint, limit)


def _repair_degrees(draft: Draft, joint: Joint, factor: float) -> None:
    """Turn a joint's limits from degrees into radians, or back."""
    limit = joint.element.find("limit")
    if limit is None:
        return
    before = f"{limit.get('lower')} to {limit.get('upper')}"
    for end in ("lower", "upper"):
        limit.set(end, f"{factor * joint.limit(end, 0.0):.6g}")
    after = f"{limit.get('lower')} to {limit.get('upper')}"
    draft.change(f"joint {joint.name!r}", f"limits {before} -> {after} rad", "")


def _repair_range(draft: Draft, joint: Joint, limit: ET.Element) -> None:
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


def _repair_effort(draft: Draft, measures: Measures, joint: Joint, limit: ET.Element) -> None:
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
        new = float(f"{2.0 * rules.GRAVITY * measures.total_mass:.2g}")
        assumed = f"force limit {new:g} N: twice the weight"
    else:
        return
    _set(draft, joint, limit, "effort", before, new, unit, assumed)


def _repair_velocity(draft: Draft, joint: Joint, limit: ET.Element) -> None:
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
