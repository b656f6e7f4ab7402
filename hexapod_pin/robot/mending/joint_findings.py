"""What is wrong with a joint's type, place, axis and coupling."""

from __future__ import annotations

import math
from collections.abc import Iterator

from hexapod_pin.robot.description.urdf_file import JOINT_TYPES, LARGEST_LENGTH, Joint, UrdfFile
from hexapod_pin.robot.mending.finding import Finding

AXIS_NORM_TOLERANCE = 1e-6
"""An axis shorter than this is zero; one off unit length by more is normalised with a note."""

KEPT_NAMES = ("root_joint", "universe")
"""Names of the floating base's joint and of the ground in Pinocchio's models."""

JOINT_TYPE_REMEDY = {
    "continuous": "in a leg: revolute, with lower and upper limits",
    "planar": "not simulated; use revolute or fixed joints",
    "floating": "only the base floats, without a joint in the file; remove it or make it fixed",
}
"""Types that are not simulated. One that is not listed needs limits and gets no finding."""

MEND_OF_TYPE = {
    "continuous": "revolute with assumed limits; a wheel-leg of one joint is left: none for it",
    "planar": "made fixed where it is at zero",
    "floating": "dropped with the link above it if that is an empty root, else made fixed",
}


def joint_findings(file: UrdfFile) -> list[Finding]:
    """Return every trouble of types, places, axes and couplings."""
    return [found for joint in file.joints for found in _of_joint(joint)]


def _of_joint(joint: Joint) -> Iterator[Finding]:
    where = f"joint {joint.name!r}"
    if not all(map(math.isfinite, joint.xyz + joint.rpy)):
        yield Finding(
            "unreadable origin",
            where,
            f"origin {_written(joint)}",
            f"xyz [m] and rpy [rad] are three numbers each, xyz at most {LARGEST_LENGTH:g} m",
            "none: write the numbers",
        )
    if joint.kind not in JOINT_TYPES:
        rule = f"known: {', '.join(JOINT_TYPES)}"
        value = f"unknown type {joint.kind!r}"
        yield Finding(
            "unknown joint type",
            where,
            value,
            rule,
            "revolute where it has limits and an axis, else fixed",
        )
        return
    if joint.moves:
        yield from _of_moved(joint, where)


def _of_moved(joint: Joint, where: str) -> Iterator[Finding]:
    if joint.kind in JOINT_TYPE_REMEDY:
        yield Finding(
            f"{joint.kind} joint",
            where,
            f"type {joint.kind}",
            JOINT_TYPE_REMEDY[joint.kind],
            MEND_OF_TYPE[joint.kind],
        )
    if joint.name in KEPT_NAMES:
        yield Finding(
            "reserved name",
            where,
            "this name is kept for the floating base or the ground",
            "another name",
            "renamed",
        )
    if joint.element.find("mimic") is not None:
        yield Finding(
            "coupled joint",
            where,
            "<mimic>",
            "coupled joints are not simulated",
            "the coupling is dropped: the joint moves by itself",
        )
    norm, axis = math.hypot(*joint.axis), " ".join(f"{value:g}" for value in joint.axis)
    if joint.kind == "floating":
        return
    if not norm >= AXIS_NORM_TOLERANCE or not math.isfinite(norm):
        yield Finding(
            "zero axis",
            where,
            f"axis {axis} has length {norm:g}",
            "must be a unit vector",
            "the joint is made fixed",
        )
    elif abs(norm - 1) > AXIS_NORM_TOLERANCE:
        yield Finding(
            "axis not of unit length",
            where,
            f"axis {axis}",
            "made a unit vector",
            "made a unit vector",
            "suspicious",
        )


def _written(joint: Joint) -> str:
    """Return the numbers of a joint's origin as they are written."""
    found = joint.element.find("origin")
    names = ("xyz", "rpy")
    return ", ".join(f"{x} {found.get(x)!r}" for x in names if found is not None and found.get(x))
