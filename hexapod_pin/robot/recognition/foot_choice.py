"""The feet of all legs are chosen together, and feet that were inferred are reported."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, UnknownNameError, UrdfError
from hexapod_pin.robot.description.urdf_file import LARGEST_RADIUS, Joint, UrdfFile
from hexapod_pin.robot.recognition.chains import Axis
from hexapod_pin.robot.recognition.feet import (
    SAME,
    FoundFoot,
    bare_foot,
    frame_foot,
    off_tip,
    shape_foot,
    trusted_frames,
)
from hexapod_pin.robot.recognition.legs import LegBody, Legs

Feet = tuple[FoundFoot, ...]


def provisional_feet(
    file: UrdfFile,
    legs: Legs,
    names: Sequence[str],
    given: Sequence[str] | None,
    radius: float | None,
) -> Feet:
    """Return the feet at the points furthest from the legs' last joints.

    Args:
        file: the URDF.
        legs: the legs.
        names: of the legs, in the same order.
        given: foot links, one per leg; None to find them.
        radius: of all feet [m]; None takes each foot's own.

    Raises:
        UrdfError: a leg without any sign of a foot; given feet that are not one on each leg.
        UnknownNameError: a given foot that is no link.
        ParameterError: a radius out of range.
    """
    if radius is not None and not 0.0 <= radius <= LARGEST_RADIUS:
        raise ParameterError("foot_radius", radius, f"from 0 to {LARGEST_RADIUS:g} m")
    downs = [np.zeros(3) if body.empty else body.furthest() for body in legs.bodies]
    if given is not None:
        return _sized(_given_feet(file, legs, names, given), radius)
    if (frames := trusted_frames(file, legs.frames, legs.bodies)) is not None:
        links, rule = frames
        return _sized(
            [frame_foot(file, legs.frames, links[c.label], rule) for c in legs.chains], radius
        )
    return _sized(_found(file, legs, names, downs), radius, downs)


def standing_feet(
    file: UrdfFile, legs: Legs, names: Sequence[str], before: Feet, angles: Sequence[Array],
    down: Array, radius: float | None,
) -> Feet:  # fmt: skip
    """Return the feet at the lowest points of the standing posture.

    Args:
        file: the URDF.
        legs: the legs.
        names: of the legs, in the same order.
        before: the provisional feet: settled ones stay.
        angles: of every leg's joints in that posture [rad].
        down: downward unit vector in the root link's frame. Shape (3,).
        radius: of all feet [m]; None takes each foot's own.
    """
    downs = [
        _unturned(body.chain.joints, legs, q, down)
        for body, q in zip(legs.bodies, angles, strict=True)
    ]
    found = _found(file, legs, names, downs)
    kept = [old if old.settled else new for old, new in zip(before, found, strict=True)]
    return _sized(kept, radius, downs)


def _found(
    file: UrdfFile, legs: Legs, names: Sequence[str], downs: Sequence[Array]
) -> list[FoundFoot]:
    """Return the feet of the legs' shapes along a direction each, else what stands for them."""
    findings, feet = [], []
    for name, body, down in zip(names, legs.bodies, downs, strict=True):
        try:
            foot = (
                shape_foot(body, down)
                if not body.empty
                else bare_foot(file, legs.frames, body, name)
            )
            feet.append(foot)
        except UrdfError as error:
            findings += error.findings
    if findings:
        raise UrdfError(file.source, findings)
    return feet


def _given_feet(
    file: UrdfFile, legs: Legs, names: Sequence[str], given: Sequence[str]
) -> list[FoundFoot]:
    """Return the given feet in the order of the legs."""
    for link in given:
        if link not in file.link_by_name:
            raise UnknownNameError("foot link", link, list(file.link_by_name))
    twice = sorted({link for link in given if list(given).count(link) > 1})
    feet, findings = (
        [],
        [f"feet: {', '.join(twice)} given twice; give each link once"] if twice else [],
    )
    for name, body in zip(names, legs.bodies, strict=True):
        on_leg = [link for link in given if link in body.chain.body]
        if len(on_leg) == 1:
            feet.append(_given_foot(file, legs, name, body, on_leg[0]))
        else:
            links = ", ".join(body.chain.body)
            findings.append(
                f"leg {name}: {len(on_leg)} of the given feet on it; give one of {links}"
            )
    if not findings and len(given) != len(feet):
        findings.append(f"{len(given)} feet given for {len(feet)} legs; give each foot link once")
    if findings:
        raise UrdfError(file.source, findings)
    return feet


def _given_foot(file: UrdfFile, legs: Legs, leg: str, body: LegBody, link: str) -> FoundFoot:
    """Return a given link's sphere or frame; where that is at the knee the tip of the shapes."""
    foot = frame_foot(file, legs.frames, link, "")
    if np.linalg.norm(body.axis.arm(foot.centre)) > SAME * max(body.reach, SAME):
        return foot
    if body.empty:
        joint = body.chain.joints[-1].name
        text = f"leg {leg}: foot {link!r} is on the axis of the last joint {joint!r}"
        raise UrdfError(file.source, [f"{text}; give feet=[...] a link at the tip"])
    return shape_foot(body, body.furthest())


def _sized(
    feet: Sequence[FoundFoot], radius: float | None, downs: Sequence[Array] | None = None
) -> Feet:
    """Return the feet with the radius that the user gives, if any: tips of shapes stay in place."""
    if radius is None:
        return tuple(feet)
    ways = [np.zeros(3)] * len(feet) if downs is None else downs
    return tuple(
        replace(
            foot,
            radius=float(radius),
            centre=foot.centre if foot.own else foot.centre + (foot.radius - radius) * down,
        )
        for foot, down in zip(feet, ways, strict=True)
    )


def _unturned(joints: Sequence[Joint], legs: Legs, angles: Array, down: Array) -> Array:
    """Return the downward direction of a posture in the last body's place at q = 0. Shape (3,)."""
    for joint, angle in zip(joints, angles, strict=True):
        unit = legs.frames.axes[joint.name].unit
        moved = float(angle) - legs.places.get(joint.name, 0.0)
        down = Axis(np.zeros(3), unit).turned(down, -moved)
    return down


# What is said of feet that were inferred: one sentence for the legs that share a rule.


def feet_text(
    file: UrdfFile, legs: Legs, names: Sequence[str], feet: Sequence[FoundFoot]
) -> list[str]:
    """Return what is inferred about feet: rules, frames that are not at the tip, shapes lost."""
    rules: dict[str, list[int]] = {}
    frames: dict[str, list[int]] = {}
    lost: dict[str, list[int]] = {}
    called = []
    for k, (body, foot) in enumerate(zip(legs.bodies, feet, strict=True)):
        name, off = off_tip(file, legs.frames, body, foot)
        called.append(name)
        for text, group in ((foot.rule, rules), (off, frames)):
            group.setdefault(text, []).append(k)
        if body.lost and not body.empty:
            lost.setdefault(body.lost[0], []).append(k)
    who = {rule: ", ".join(names[k] for k in places) for rule, places in rules.items()}
    return [
        *(
            f"feet of {who[rule]}: {rule}, on {_listed([feet[k].link for k in places])};"
            f" {_sizes(legs, feet, places)}"
            for rule, places in rules.items()
            if rule
        ),
        *(
            f"frames of {_listed([called[k] for k in places])} are called feet but are {text}"
            for text, places in frames.items()
            if text
        ),
        *(
            f"a shape of leg {names[places[0]]} is not used: {text}"
            for text, places in lost.items()
        ),
    ]


def _listed(names: Sequence[str]) -> str:
    """Return names in a row, long rows by their first and last ones."""
    short = names if len(names) < 4 else (*names[:2], "...", names[-1])
    return ", ".join(short)


def _sizes(legs: Legs, feet: Sequence[FoundFoot], places: Sequence[int]) -> str:
    """Return the range of the feet's distances from the last joints and of their radii."""
    reach = [
        float(np.linalg.norm(legs.bodies[k].axis.arm(feet[k].centre))) + feet[k].radius
        for k in places
    ]
    far, size = _span(reach), _span([feet[k].radius for k in places])
    return f"end {far} mm from the last joint, radius {size} mm"


def _span(values: Sequence[float]) -> str:
    """Return the range of lengths [m] in millimetres."""
    low, high = (f"{1e3 * float(value):.1f}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"
