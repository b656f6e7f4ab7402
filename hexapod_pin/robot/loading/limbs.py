"""Legs and their feet: six of three joints found by name in the tree of a URDF.

Legs that a file states itself (`stated_legs`) go before; nothing goes by position.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.errors import UnknownNameError, UrdfError
from hexapod_pin.robot.description.leg_names import LEG_NAMES, leg_of_chain
from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.description.urdf_inertia import rotation

FOOT_WORDS = ("foot", "tip", "tarsus")
"""A foot link has one of these in its name; an earlier word wins."""

TURNING = ("revolute", "continuous")
"""Kinds of joints that legs walk with."""

Chain = tuple[str, str, str]


@dataclass(frozen=True)
class Leg:
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
