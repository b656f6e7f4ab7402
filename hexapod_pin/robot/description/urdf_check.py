"""What makes a URDF unusable (findings) or suspicious (notes), each naming its link or joint."""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

from hexapod_pin.robot.description.urdf_file import JOINT_TYPES, Joint, UrdfFile
from hexapod_pin.robot.description.urdf_inertia import inertia_findings, inertia_notes

AXIS_NORM_TOLERANCE = 1e-6
"""An axis shorter than this is zero; one off unit length by more is normalised with a note."""

MAX_MOVED_JOINTS = 300
"""Larger models are refused: the mass matrix and its workspace grow with the square."""

JOINT_TYPE_REMEDY = {
    "continuous": "make it revolute and give it lower and upper limits",
    "planar": "not simulated; use revolute or fixed joints",
    "floating": "only the base floats, without a joint in the file; remove it or make it fixed",
}


class UrdfCheck(NamedTuple):
    """Findings (the file is refused) and notes (it is used)."""

    findings: list[str]
    notes: list[str]


def check_urdf(file: UrdfFile) -> UrdfCheck:
    """Check structure, joints and inertias; all findings at once.

    Structure comes first: where the links and joints do not form one tree, masses that move
    together cannot be told, and only the structural and joint findings are listed.
    """
    structure = structure_findings(file)
    findings = structure + [text for joint in file.joints for text in joint_findings(joint)]
    if structure:
        return UrdfCheck(findings, [])
    notes = [text for joint in file.joints for text in _joint_notes(joint)]
    moved = sum(joint.moves for joint in file.joints)
    if moved > MAX_MOVED_JOINTS:
        findings.append(f"{moved} moved joints; at most {MAX_MOVED_JOINTS} are simulated")
    findings += inertia_findings(file)
    return UrdfCheck(findings, [] if findings else notes + inertia_notes(file))


def structure_findings(file: UrdfFile) -> list[str]:
    """Return what keeps links and joints from being one tree with unique names."""
    found = []
    if not file.links:
        return ["no <link>: a robot needs at least one"]
    for kind, names in (("link", [x.name for x in file.links]),
                        ("joint", [x.name for x in file.joints])):  # fmt: skip
        found += [f"{kind} {name!r}: {count} of that name; names must be unique"
                  for name, count in Counter(names).items() if count > 1]  # fmt: skip
        found += [f"a {kind} has no name" for name in names if not name]
    known = set(file.link_by_name)
    for joint in file.joints:
        for end, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in known:
                found.append(f"joint {joint.name!r}: its {end} link {link!r} does not exist")
    return found + _tree_findings(file)


def _tree_findings(file: UrdfFile) -> list[str]:
    """Return links with two parents, loops and additional roots."""
    parents: dict[str, list[str]] = {}
    for joint in file.joints:
        parents.setdefault(joint.child, []).append(joint.name)
    found = [
        f"link {link!r}: child of {len(joints)} joints ({', '.join(map(repr, joints))});"
        " the links must form a tree"
        for link, joints in parents.items()
        if len(joints) > 1
    ]
    roots = [link.name for link in file.links if link.name not in parents]
    if len(roots) > 1:
        found.append(f"links {', '.join(map(repr, roots))}: {len(roots)} roots; must be one")
    if found or len(file.link_by_name) < len(file.links):
        return found
    return _loop_findings(file, roots)


def _loop_findings(file: UrdfFile, roots: list[str]) -> list[str]:
    """Return the links that no root leads to: they hang on a loop."""
    reached = list(roots)
    for name in reached:
        reached += [j.child for j in file.joints_below[name] if j.child in file.link_by_name]
    lost = [link.name for link in file.links if link.name not in set(reached)]
    if not lost:
        return []
    return [f"links {', '.join(map(repr, lost))}: on a loop of joints; the links must form a tree"]


def joint_findings(joint: Joint) -> list[str]:
    """Return what is wrong with one joint."""
    where = f"joint {joint.name!r}"
    if joint.kind not in JOINT_TYPES:
        return [f"{where}: unknown type {joint.kind!r}; known: {', '.join(JOINT_TYPES)}"]
    found = []
    if not all(map(math.isfinite, joint.xyz + joint.rpy)):
        found.append(f"{where}: its origin is not three finite numbers for xyz and rpy")
    if not joint.moves:
        return found
    if joint.kind in JOINT_TYPE_REMEDY:
        found.append(f"{where}: type {joint.kind}: {JOINT_TYPE_REMEDY[joint.kind]}")
    if joint.name == "root_joint":
        found.append(f"{where}: this name is kept for the floating base; rename the joint")
    if joint.element.find("mimic") is not None:
        found.append(f"{where}: <mimic>: coupled joints are not simulated; remove it or fix it")
    norm = math.hypot(*joint.axis)
    if not norm >= AXIS_NORM_TOLERANCE or not math.isfinite(norm):
        axis = _numbers(joint.axis)
        found.append(f"{where}: axis {axis} has length {norm:g}; must be a unit vector")
    return found + ([] if joint.kind in JOINT_TYPE_REMEDY else _limit_findings(joint, where))


def _limit_findings(joint: Joint, where: str) -> list[str]:
    """Return what is wrong with the limits and dynamics of a revolute joint."""
    if joint.element.find("limit") is None:
        return [f"{where}: no <limit>; give lower, upper, effort and velocity"]
    found = []
    lower, upper = joint.limit("lower", 0.0), joint.limit("upper", 0.0)
    if not (math.isfinite(lower) and math.isfinite(upper)):
        found.append(f"{where}: limits {lower:g} to {upper:g} rad; must be finite")
    elif lower > upper:
        found.append(f"{where}: lower limit {lower:g} rad is above the upper limit {upper:g} rad")
    effort, velocity = joint.limit("effort"), joint.limit("velocity")
    if not effort >= 0:
        found.append(f"{where}: effort {effort:g} N m; must be at least 0")
    if not velocity > 0:
        found.append(f"{where}: velocity {velocity:g} rad/s; must be above 0")
    for name, unit in (("damping", "N m s/rad"), ("friction", "N m")):
        value = joint.dynamics(name)
        if not (value >= 0 and math.isfinite(value)):
            found.append(f"{where}: {name} {value:g} {unit}; must be finite and at least 0")
    return found


def _joint_notes(joint: Joint) -> list[str]:
    """Return what the loader changes or drops about a joint."""
    if not joint.moves:
        return []
    notes, norm = [], math.hypot(*joint.axis)
    if AXIS_NORM_TOLERANCE <= norm and abs(norm - 1) > AXIS_NORM_TOLERANCE:
        notes.append(f"joint {joint.name}: axis {_numbers(joint.axis)} made a unit vector")
    return notes


def _numbers(values: tuple[float, ...]) -> str:
    """Return a vector as in the file."""
    return " ".join(f"{value:g}" for value in values)
