"""The legs and feet of a URDF are stated in its <hexapod_pin> element or found by name.

Legs that a file states itself go before; nothing goes by position.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, UnknownNameError, UrdfError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.description.leg_names import LEG_NAMES, leg_of_chain
from hexapod_pin.robot.description.solids import rotation
from hexapod_pin.robot.description.urdf_file import (
    LARGEST_LENGTH,
    LARGEST_RADIUS,
    Joint,
    Sphere,
    UrdfFile,
    attribute,
)
from hexapod_pin.robot.loading.pin_model import placement

if TYPE_CHECKING:
    import pinocchio as pin


FOOT_WORDS = ("foot", "tip", "tarsus")
"""A foot link has one of these in its name; an earlier word wins."""

TURNING = ("revolute", "continuous")
"""Kinds of joints that legs walk with."""

Chain = tuple[str, str, str]


@dataclass(frozen=True)
class Leg(Immutable):
    """One leg.

    Attributes:
        name: lf, lm, lr, rf, rm or rr where there are six; else as the file states it.
        joints: names of the joints it walks with, proximal first: coxa, femur and tibia, or coxa
            and femur. Two or three; other joints between trunk and foot are held.
        foot: name of the foot link.
    """

    name: str
    joints: tuple[str, ...]
    foot: str


@dataclass(frozen=True)
class Limbs:
    """What stands on the ground.

    Attributes:
        legs: six legs in the order lf lm lr rf rm rr, or those that the file states; empty where
            the robot has no legs to walk with.
        feet: foot links, in the order of the legs, or as given.
        notes: how legs were named where their joints' names did not say it.
    """

    legs: tuple[Leg, ...]
    feet: tuple[str, ...]
    notes: tuple[str, ...] = ()


def find_limbs(file: UrdfFile, feet: Sequence[str] | None = None) -> Limbs:
    """Find six three-joint legs; feet by name, or as given.

    Args:
        file: a URDF without findings.
        feet: foot links. Needed where no link fixed to the tibia is named foot, tip or tarsus,
            and for robots without six three-joint legs: those get feet but no legs.

    Raises:
        UrdfError: not six three-joint legs and no `feet`; legs without a foot; feet that do not
            lie one on each leg.
        UnknownNameError: a foot that is no link.
    """
    if feet is not None:
        _check_feet(file, feet)
    chains, others = leg_chains(file)
    if len(chains) != 6 or others:
        if feet is None:
            raise UrdfError(file.source, [_wrong_legs(file, chains, others)])
        return Limbs((), tuple(feet))
    named, note = _named(file, chains)
    owners = _given_feet(file, named, feet) if feet is not None else _found_feet(file, named)
    legs = tuple(Leg(name, named[name], owners[name]) for name in LEG_NAMES)
    return Limbs(legs, tuple(leg.foot for leg in legs), (note,) if note else ())


def leg_chains(file: UrdfFile) -> tuple[list[Chain], list[str]]:
    """Return unbranched chains of three turning joints from the base, and the other moved ones."""
    chains: list[Chain] = []
    for first in file.moved_joints_below(file.base):
        links, below = [first], file.moved_joints_below(first.child)
        while len(below) == 1:
            links.append(below[0])
            below = file.moved_joints_below(below[0].child)
        if len(links) == 3 and not below and all(joint.kind in TURNING for joint in links):
            chains.append((links[0].name, links[1].name, links[2].name))
    taken = {name for chain in chains for name in chain}
    return chains, [j.name for j in file.joints if j.moves and j.name not in taken]


def tree_text(file: UrdfFile) -> str:
    """Return the links, indented below their parents, each with the joint that carries it."""
    lines, stack = [], [(file.base, "", 0)]
    while stack:
        link, how, depth = stack.pop()
        lines.append("  " * depth + link + how)
        for joint in reversed(file.joints_below[link]):
            stack.append((joint.child, f" <- {joint.name} ({joint.kind})", depth + 1))
    return "\n".join(lines)


def _wrong_legs(file: UrdfFile, chains: list[Chain], others: list[str]) -> str:
    """Say what was found instead of six three-joint legs."""
    extra = f" and other moved joints ({', '.join(others)})" if others else ""
    return (
        f"{len(chains)} three-joint legs{extra} on {file.base!r}: must be exactly 6 and nothing"
        " else that moves. For a simulation without gait give feet=[...], the names of the foot"
        f" links. The tree:\n{tree_text(file)}"
    )


def _check_feet(file: UrdfFile, feet: Sequence[str]) -> None:
    """Refuse feet that are no links, twice the same, or none."""
    known = list(file.link_by_name)
    for name in feet:
        if name not in file.link_by_name:
            raise UnknownNameError("foot link", name, known)
    twice = sorted({name for name in feet if list(feet).count(name) > 1})
    if twice or not feet:
        what = f"{', '.join(twice)} given twice" if twice else "is empty"
        raise UrdfError(file.source, [f"feet=[...] {what}: give each foot link once"])


def _named(file: UrdfFile, chains: list[Chain]) -> tuple[dict[str, Chain], str]:
    """Return leg name -> chain, from the joints' names or else from the hips' positions."""
    named = {leg_of_chain(chain): chain for chain in chains}
    by_name = {leg: chain for leg, chain in named.items() if leg is not None}
    if len(by_name) == 6:
        return by_name, ""
    hips = {chain: _hip(file, chain[0]) for chain in chains}
    left = sorted((c for c in chains if hips[c][1] > 0), key=lambda c: -hips[c][0])
    right = sorted((c for c in chains if hips[c][1] < 0), key=lambda c: -hips[c][0])
    if len(left) != 3 or len(right) != 3:
        raise UrdfError(file.source, [_unnamed(chains)])
    note = "legs named by where their hips are: y > 0 is left, front to rear along -x"
    return dict(zip(LEG_NAMES, left + right, strict=True)), note


def _unnamed(chains: list[Chain]) -> str:
    """Say that neither names nor hips tell the legs apart."""
    return (
        f"cannot name the legs: joints {', '.join(chain[0] for chain in chains)} follow no known"
        " naming and are not three on each side (y > 0 left, y < 0 right);"
        " name the joints lf_coxa_joint, lf_femur_joint, lf_tibia_joint, ..."
    )


def _hip(file: UrdfFile, joint_name: str) -> tuple[float, float, float]:
    """Return the origin of a joint in the base link's frame [m], through fixed joints."""
    by_child = {joint.child: joint for joint in file.joints}
    joint = next(joint for joint in file.joints if joint.name == joint_name)
    point, link = np.array(joint.xyz), joint.parent
    while link in by_child:
        carrier = by_child[link]
        point = np.array(carrier.xyz) + rotation(carrier.rpy) @ point
        link = carrier.parent
    return float(point[0]), float(point[1]), float(point[2])


def _tibia_links(file: UrdfFile, chain: Chain) -> list[str]:
    """Return the link moved by a leg's last joint and all links fixed to it."""
    return file.rigid_group(next(j.child for j in file.joints if j.name == chain[2]))


def _found_feet(file: UrdfFile, named: dict[str, Chain]) -> dict[str, str]:
    """Return leg -> foot link, found by name among the links fixed to the tibia."""
    owners, findings = {}, []
    for leg, chain in named.items():
        tibia, *fixed = _tibia_links(file, chain)
        matches = [name for word in FOOT_WORDS for name in reversed(fixed) if word in name.lower()]
        if matches:
            owners[leg] = matches[0]
        else:
            findings.append(
                f"leg {leg}: no link fixed to {tibia!r} has foot, tip or tarsus in its name;"
                " give feet=[...], the names of six links"
            )
    if findings:
        raise UrdfError(file.source, findings)
    return owners


def _given_feet(file: UrdfFile, named: dict[str, Chain], feet: Sequence[str]) -> dict[str, str]:
    """Return leg -> foot link, each given foot assigned to the leg whose tibia carries it."""
    owners, findings = {}, []
    for leg, chain in named.items():
        links = _tibia_links(file, chain)
        on_leg = [name for name in feet if name in links]
        if len(on_leg) == 1:
            owners[leg] = on_leg[0]
        else:
            given = f"{len(on_leg)} of the given feet"
            findings.append(f"leg {leg}: {given} on it; give one of {', '.join(links)}")
    stray = [name for name in feet if name not in owners.values()]
    findings += [f"foot {name!r}: not on the last link of a leg" for name in stray if not findings]
    if findings:
        raise UrdfError(file.source, findings)
    return owners


# Legs and held joints that a URDF states itself, in its <hexapod_pin> element.
#
# ```xml
# <hexapod_pin>
#   <leg name="lf" joints="lf_coxa lf_femur lf_tibia" foot="lf_foot"/> ...
#   <held joint="head_pan" position="0.1"/> ...
# </hexapod_pin>
# ```
# Joints whose names have blanks in them are separated by tabs.
# What is stated goes before every search by names. A joint that no leg walks with is held.

MIN_LEGS, MAX_LEGS = 4, 8
"""Legs of a robot that walks."""

MIN_LEG_JOINTS, MAX_LEG_JOINTS = 2, 3
"""Joints with which a leg walks; others between trunk and foot are held."""


def stated_limbs(file: UrdfFile, feet: Sequence[str] | None = None) -> Limbs | None:
    """Return the legs that a file states, None where it states none.

    Args:
        file: a URDF without findings.
        feet: foot links as given by the user; they must be the stated ones.

    Returns:
        Legs in the file's order; six legs named as in `LEG_NAMES` in that order.

    Raises:
        UrdfError: an element names what does not exist or no chain from the trunk to the foot, a
            joint serves twice, the count is not 4 to 8, or other feet are given; all at once.
    """
    legs = _stated(file)
    if not legs:
        return None
    findings = stated_leg_faults(file)
    stated = [leg.foot for leg in legs]
    if feet is not None and sorted(feet) != sorted(stated):
        findings.append(f"feet {list(feet)}: the file states {stated}; give these, or none")
    if findings:
        raise UrdfError(file.source, findings)
    if sorted(leg.name for leg in legs) == sorted(LEG_NAMES):
        legs.sort(key=lambda leg: LEG_NAMES.index(leg.name))
    return Limbs(tuple(legs), tuple(leg.foot for leg in legs))


def stated_leg_faults(file: UrdfFile) -> list[str]:
    """Return what is wrong with the legs that a file states, a sentence each."""
    legs = _stated(file)
    found = [text for leg in legs for text in _leg_findings(file, leg)]
    return found + (_count_findings(legs) if legs else [])


def _stated(file: UrdfFile) -> list[Leg]:
    """Return the legs that a file states, unchecked."""
    element = file.root.find("hexapod_pin")
    return [] if element is None else [_leg(entry) for entry in element.findall("leg")]


def stated_places(file: UrdfFile) -> dict[str, float]:
    """Return joint name -> place [rad, or m of a sliding joint] of the <held> elements.

    Raises:
        UrdfError: no moved joint of that name, or no finite place; all at once.
    """
    element = file.root.find("hexapod_pin")
    places: dict[str, float] = {}
    findings = []
    moved = {joint.name for joint in file.joints if joint.moves}
    for entry in [] if element is None else element.findall("held"):
        name, place = entry.get("joint") or "", attribute(entry, "position", math.nan)
        places[name] = place
        if name not in moved:
            findings.append(f"<held>: no moved joint {name!r}")
        elif not math.isfinite(place):
            text = entry.get("position")
            findings.append(f"<held> joint {name!r}: position {text!r}; give a number [rad or m]")
    if findings:
        raise UrdfError(file.source, findings)
    return places


def _leg(entry: Element) -> Leg:
    """Return the leg of an element, unchecked."""
    text = entry.get("joints") or ""
    joints = tuple(text.split("\t") if "\t" in text else text.split())
    return Leg(entry.get("name") or "", joints, entry.get("foot") or "")


def _leg_findings(file: UrdfFile, leg: Leg) -> list[str]:
    """Return what is wrong with one stated leg."""
    where = f"<leg name={leg.name!r}>"
    found = [] if leg.name else [f"{where}: has no name"]
    if not MIN_LEG_JOINTS <= len(leg.joints) <= MAX_LEG_JOINTS:
        text = f"{where}: {len(leg.joints)} joints; a leg walks with 2 or 3, state others as <held>"
        found.append(text)
    if leg.foot not in file.link_by_name:
        return [*found, f"{where}: no foot link {leg.foot!r}"]
    above = moved_joints_above(file, leg.foot)
    names = [joint.name for joint in above]
    if [name for name in names if name in leg.joints] != list(leg.joints):
        text = f"joints {' '.join(leg.joints)} are not in this order among those that move"
        found.append(f"{where}: {text} foot {leg.foot!r}: {' '.join(names) or 'none'}")
    slides = [x.name for x in above if x.name in leg.joints and x.kind not in TURNING]
    found += [f"{where}: joint {name!r} does not turn; state it as <held>" for name in slides]
    return found


def _count_findings(legs: Sequence[Leg]) -> list[str]:
    """Return what is wrong with the legs together."""
    found = []
    if not MIN_LEGS <= len(legs) <= MAX_LEGS:
        found.append(f"{len(legs)} <leg> elements; a robot walks on {MIN_LEGS} to {MAX_LEGS} legs")
    parts = {
        "leg": [leg.name for leg in legs],
        "foot": [leg.foot for leg in legs],
        "joint": [joint for leg in legs for joint in leg.joints],
    }
    for kind, names in parts.items():
        twice = [name for name, count in Counter(names).items() if count > 1]
        found += [f"<leg>: {kind} {name!r} stated more than once" for name in twice]
    return found


def moved_joints_above(file: UrdfFile, link: str) -> list[Joint]:
    """Return the moved joints between the base and a link, from the base outwards."""
    by_child = {joint.child: joint for joint in file.joints}
    above: list[Joint] = []
    while link in by_child:
        joint = by_child.pop(link)  # each once, also where they form a loop
        above += [joint] if joint.moves else []
        link = joint.parent
    return above[::-1]


# Feet: spheres fixed to links, the only parts of a robot that touch the ground.


@dataclass(frozen=True, eq=False)
class Foot(Immutable):
    """A sphere fixed to a link that may touch the ground.

    Attributes:
        name: name of its link.
        leg: name of its leg; None where the robot has no legs of three joints.
        joint: name of the joint that moves it ("root_joint" where it is fixed to the base).
        offset: (3,) centre of the sphere in that joint's frame [m].
        radius: radius [m]; 0 is a point foot.
    """

    name: str
    leg: str | None
    joint: str
    offset: Array
    radius: float


def place_feet(
    file: UrdfFile, model: pin.Model, limbs: Limbs, radius: float | None = None
) -> tuple[tuple[Foot, ...], list[str]]:
    """Return the feet with their spheres, and notes on feet that have none.

    Args:
        file: the URDF.
        model: its model.
        limbs: which links are feet.
        radius: radius of all feet [m]; None takes each link's collision sphere, else a point.

    Raises:
        ParameterError: a radius out of range.
        UrdfError: a collision sphere whose numbers are.
    """
    if radius is not None and not 0.0 <= radius <= LARGEST_RADIUS:
        raise ParameterError("foot_radius", radius, f"from 0 to {LARGEST_RADIUS:g} m")
    owner = {leg.foot: leg.name for leg in limbs.legs}
    feet, points = [], []
    for name in limbs.feet:
        sphere = file.link_by_name[name].collision_sphere
        if sphere is None and radius is None:
            points.append(name)
        sphere = _checked(file, name, sphere or Sphere(0.0, (0.0, 0.0, 0.0)))
        joint, place = placement(model, name)
        centre = read_only(place.act(np.array(sphere.centre)))
        size = sphere.radius if radius is None else float(radius)
        feet.append(Foot(name, owner.get(name), joint, centre, size))
    note = f"no collision sphere on {', '.join(points)}: point feet (or give foot_radius)"
    return tuple(feet), [note] if points else []


def _checked(file: UrdfFile, link: str, sphere: Sphere) -> Sphere:
    """Return a sphere whose numbers are possible."""
    if not all(map(math.isfinite, (sphere.radius, *sphere.centre))) or sphere.radius < 0:
        text = f"link {link!r}: collision sphere of radius {sphere.radius:g} m at {sphere.centre}"
        raise UrdfError(
            file.source,
            [f"{text}; must be numbers up to {LARGEST_LENGTH:g} m, the radius not negative"],
        )
    return sphere
