"""Limbs are taken as legs by their likeness, or as the user names them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.recognition.chains import (
    LEG_COUNTS,
    MOST_JOINTS,
    Chain,
    TreeFrames,
    axis_distance,
    limb_chains,
    links_below,
    refuse_wrong_legs,
    similar_chains,
    tree_frames,
)
from hexapod_pin.robot.recognition.layout import held_place
from hexapod_pin.robot.recognition.shape_points import LegBody, leg_body

if TYPE_CHECKING:
    from hexapod_pin.robot.reading.resources import ResourceFinder


@dataclass(frozen=True, eq=False)
class Legs:
    """The legs of a robot before they are named.

    Attributes:
        chains: their joints.
        bodies: their last bodies, in the same order.
        tips: furthest point of each by its chain's label, root link's frame [m]. Shape (3,) each.
        frames: of all links and joints, with `places`.
        places: of the moved joints that are in no leg, and of those a leg holds [rad or m].
        given: names that the user gave, in the same order; None.
    """

    chains: tuple[Chain, ...]
    bodies: tuple[LegBody, ...]
    tips: dict[str, Array]
    frames: TreeFrames
    places: dict[str, float]
    given: tuple[str, ...] | None


def choose_legs(
    file: UrdfFile,
    finder: ResourceFinder,
    given: Mapping[str, Sequence[str]] | None,
    held: Mapping[str, float],
) -> Legs:
    """Return the legs on the root link: 4 to 8 chains alike, or those that are given.

    Raises:
        UrdfError: the limbs are no legs, or the given legs do not exist; with a remedy.
    """
    chains = limb_chains(file, file.base)
    if given is not None:
        chains = _given_chains(file, chains, given)
    else:
        chains = evened_chains(file, tree_frames(file, {}), chains)
    walking = {joint.name for chain in chains for joint in chain.joints}
    places = {
        joint.name: held_place(joint, held)
        for joint in file.joints
        if joint.moves and (joint.name not in walking or joint.name in held)
    }
    frames = tree_frames(file, places)
    bodies = {chain.label: leg_body(file, finder, frames, chain) for chain in chains}
    tips = {label: _far(body, frames) for label, body in bodies.items()}
    if given is None:
        chains = similar_chains(chains, frames, tips)
        refuse_wrong_legs(file, file.base, chains)
    legs = {joint.name for chain in chains for joint in chain.joints}
    rest = [joint for joint in file.joints if joint.moves and joint.name not in legs]
    places |= {joint.name: held_place(joint, held) for joint in rest}
    return Legs(
        tuple(chains), tuple(bodies[chain.label] for chain in chains), tips,
        tree_frames(file, places), places, None if given is None else tuple(given),
    )  # fmt: skip


def _far(body: LegBody, frames: TreeFrames) -> Array:
    """Return the point of a body furthest from its joint: of its frames where it has no shape."""
    axis = body.axis
    if not body.empty:
        return np.asarray(axis.origin + body.reach * body.furthest())
    places = [frames.links[name].position for name in body.chain.body]
    return max(places, key=lambda place: float(np.linalg.norm(axis.arm(place))))


def _given_chains(
    file: UrdfFile, chains: Sequence[Chain], given: Mapping[str, Sequence[str]]
) -> list[Chain]:
    """Return the limbs that the user names, with the joints named where there are several."""
    found, findings = [], []
    for leg, members in given.items():
        names = [members] if isinstance(members, str) else list(members)
        owners = [chain for chain in chains if set(names) <= {*chain.names, *_joints(chain)}]
        if not names or len(owners) != 1:
            known = "; ".join(", ".join(_joints(chain)) for chain in chains)
            findings.append(
                f"legs=[...], leg {leg}: {', '.join(names) or 'nothing'} is no joint or link of"
                f" one limb on {file.base!r}; the limbs: {known}"
            )
        else:
            found.append(_narrowed(owners[0], names) if len(names) > 1 else owners[0])
    counts = {len(chain.joints) for chain in found}
    if findings:
        pass
    elif len({chain.label for chain in found}) < len(found):
        findings = ["legs=[...]: two legs on the same limb; name each limb once"]
    elif len(counts) != 1 or not 2 <= min(counts) <= MOST_JOINTS:
        findings = [f"legs=[...]: legs of {sorted(counts)} joints; all must have 2 to 5, the same"]
    elif len(found) not in LEG_COUNTS:
        findings = [f"legs=[...]: {len(found)} legs; must be 4 to 8"]
    if findings:
        raise UrdfError(file.source, findings)
    return found


def _narrowed(chain: Chain, names: Sequence[str]) -> Chain:
    """Return a limb with only these joints walking; the others are held."""
    joints = tuple(joint for joint in chain.joints if joint.name in names)
    left = tuple(joint for joint in chain.joints if joint.name not in names)
    return replace(chain, joints=joints, others=(*left, *chain.others)) if joints else chain


def _joints(chain: Chain) -> list[str]:
    """Return the names of a limb's joints."""
    return [joint.name for joint in (*chain.joints, *chain.others)]


# Legs of which some have one joint more than the others: a joint fixed in one leg alone.

FEWEST = 3
"""Fewest joints of a leg that may hold one."""

SAME_LINKS = 0.05
"""Links of the same leg differ by less than this share of their sum (*assumed*)."""


def evened_chains(file: UrdfFile, frames: TreeFrames, chains: Sequence[Chain]) -> list[Chain]:
    """Return limbs of which those that only have one joint more than like ones hold that joint.

    It is done where it makes an even number of 4 to 8 legs that the limbs do not have already:
    a robot of whose six equal legs one has its last joint fixed is no robot of five legs.
    """
    counts = [len(chain.joints) for chain in chains]
    if any(counts.count(k) in LEG_COUNTS and not counts.count(k) % 2 for k in counts):
        return list(chains)
    for most in sorted(set(counts), reverse=True):
        both = [chain for chain in chains if len(chain.joints) in (most, most - 1)]
        mixed = most - 1 in counts and most > FEWEST
        if mixed and len(both) in LEG_COUNTS and not len(both) % 2:
            cut = [_without_last(file, c) if len(c.joints) == most else c for c in both]
            if _alike(frames, cut):
                short = {chain.label: chain for chain in cut}
                return [short.get(chain.label, chain) for chain in chains]
    return list(chains)


def _without_last(file: UrdfFile, chain: Chain) -> Chain:
    """Return a limb whose last walking joint is one of the others."""
    joints, last = chain.joints[:-1], chain.joints[-1]
    body = links_below(file, joints[-1])
    return replace(chain, joints=joints, others=(last, *chain.others), body=body)


def _alike(frames: TreeFrames, chains: Sequence[Chain]) -> bool:
    """Return whether the distances of successive axes are the same in all limbs."""
    axes = [[frames.axes[joint.name] for joint in chain.joints] for chain in chains]
    links = np.array([[axis_distance(*p) for p in zip(a, a[1:], strict=False)] for a in axes])
    size = float(np.median(links.sum(axis=1)))
    return bool(np.abs(links - np.median(links, axis=0)).max() <= SAME_LINKS * size)
