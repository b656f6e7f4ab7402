"""Legs as chains of moved joints that start at the trunk, whatever they are called."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile
from hexapod_pin.robot.recognition.tree_frames import TURNING, Axis, TreeFrames

MOST_JOINTS = 5
LEG_COUNTS = (4, 5, 6, 7, 8)

UNLIKE = 0.35
"""A chain whose links differ from those of the others by more than this share of the chain's
length is no leg (*assumed*)."""

NEAR_PARALLEL = 0.05
"""Axes at a smaller sine are parallel: angles such as 3.14 in a file are rounded (*assumed*)."""


@dataclass(frozen=True, eq=False)
class Chain:
    """Moved joints from the trunk to the end of a limb.

    Attributes:
        joints: those that can walk (revolute or continuous, not mimic), from the trunk outwards.
        others: every other moved joint below the first one.
        body: the links beyond the last of `joints`, nearest first.
        names: of all joints and links of this limb alone.
    """

    joints: tuple[Joint, ...]
    others: tuple[Joint, ...]
    body: tuple[str, ...]
    names: tuple[str, ...]

    @property
    def label(self) -> str:
        """The first joint's name, for messages."""
        return self.joints[0].name


def walks(joint: Joint) -> bool:
    """Tell whether a joint can be a leg's."""
    return joint.kind in TURNING and joint.element.find("mimic") is None


def limb_chains(file: UrdfFile, trunk: str) -> list[Chain]:
    """Return the limbs on the rigid group of a link, one for every moved joint on it."""
    parents = {joint.child: joint for joint in file.joints}
    chains = []
    for first in file.moved_joints_below(trunk):
        path = max(_paths(file, first), key=lambda path: sum(map(walks, path)))
        below = _below(file, first)
        joints = tuple(joint for joint in path if walks(joint))
        if joints:
            moved = [joint for joint in below if joint.moves and joint not in joints]
            body = links_below(file, joints[-1])
            names = [name for joint in below for name in (joint.name, joint.child)]
            chains.append(
                Chain(joints, tuple(moved), body, (*_own_base(file, parents, first), *names))
            )
    return chains


def similar_chains(
    chains: Sequence[Chain], frames: TreeFrames, tips: dict[str, Array]
) -> list[Chain]:
    """Return the chains that are legs: as many joints, and links alike (the most common kind)."""
    by_count: dict[int, list[Chain]] = {}
    for chain in chains:
        by_count.setdefault(len(chain.joints), []).append(chain)
    best = max(by_count.values(), key=lambda group: (len(group), len(group[0].joints)), default=[])
    if not 2 <= len(best[0].joints if best else ()) <= MOST_JOINTS or len(best) < min(LEG_COUNTS):
        return list(best)
    lengths = np.array([_link_lengths(chain, frames, tips[chain.label]) for chain in best])
    middle = np.median(lengths, axis=0)
    off = np.abs(lengths - middle).max(axis=1) / max(float(middle.sum()), 1e-12)
    return [chain for chain, share in zip(best, off, strict=True) if share <= UNLIKE]


def refuse_wrong_legs(file: UrdfFile, trunk: str, chains: Sequence[Chain]) -> None:
    """Raise UrdfError where the limbs found are no 4 to 8 legs of 2 to 5 joints."""
    joints = len(chains[0].joints) if chains else 0
    if len(chains) in LEG_COUNTS and 2 <= joints <= MOST_JOINTS:
        return
    raise UrdfError(file.source, [_wrong_legs(file, trunk, chains, joints)])


def _wrong_legs(file: UrdfFile, trunk: str, chains: Sequence[Chain], joints: int) -> str:
    """Say what was found instead of legs, and the way out."""
    firsts = ", ".join(chain.label for chain in chains)
    if joints == 1 and len(chains) >= min(LEG_COUNTS):
        return (
            f"{len(chains)} limbs of one turning joint each on {trunk!r} ({firsts}): wheel-legs."
            " Their feet cannot be set down at chosen points, so no gait of feet walks them. What"
            " works: as revolute joints with wide limits and with feet=[...] the robot stands, and"
            " set-points of your own turn them. For a walk each leg needs 2 to 5 joints"
        )
    if joints > MOST_JOINTS:
        return (
            f"limbs of {joints} joints each on {trunk!r} ({firsts}): legs have 2 to"
            f" {MOST_JOINTS}; fix the surplus joints, or name the legs' joints with legs=[...]"
        )
    fixed = file.rigid_group(trunk)
    for link in (link for link in file.links if link.name not in fixed):
        inner = [chain for chain in limb_chains(file, link.name) if len(chain.joints) >= 2]
        if len(inner) >= min(LEG_COUNTS):
            carrier = _carrier(file, link.name)
            return (
                f"{len(inner)} limbs start at {link.name!r}, which joint {carrier.name!r}"
                f" ({carrier.kind}) moves: the trunk must be the root link {trunk!r} or fixed to"
                " it. Make that joint fixed, or remove what stands above it (a robot's trunk"
                " floats without a joint)"
            )
    slides = sum(joint.moves and not walks(joint) for joint in file.joints)
    none = f"no turning limbs ({slides} joints move otherwise)" if slides else "no moved limbs"
    found = f"{len(chains)} limbs of {joints} joints ({firsts})" if chains else none
    return (
        f"{found} on {trunk!r}: a walk needs 4 to 8 similar legs of 2 to {MOST_JOINTS} turning"
        " joints. Name the legs with legs=[...]; for a simulation without gait give feet=[...],"
        " the names of the foot links"
    )


def _link_lengths(chain: Chain, frames: TreeFrames, tip: Array) -> list[float]:
    """Return the distances between successive axes, and of the tip from the last one [m]."""
    axes = [frames.axes[joint.name] for joint in chain.joints]
    between = [axis_distance(a, b) for a, b in zip(axes, axes[1:], strict=False)]
    return [*between, float(np.linalg.norm(axes[-1].arm(tip)))]


def axis_distance(a: Axis, b: Axis) -> float:
    """Return the distance of two lines, parallel ones to rounding included [m]."""
    normal = np.cross(a.unit, b.unit)
    size = float(np.linalg.norm(normal))
    if size < NEAR_PARALLEL:
        return float(np.linalg.norm(a.arm(b.origin)))
    return abs(float((b.origin - a.origin) @ normal)) / size


def _paths(file: UrdfFile, first: Joint) -> list[list[Joint]]:
    """Return every chain of moved joints from `first` to an end of the tree."""
    done, open_paths = [], [[first]]
    while open_paths:
        path = open_paths.pop(0)
        following = file.moved_joints_below(path[-1].child)
        if not following:
            done.append(path)
        open_paths += [[*path, joint] for joint in following]
    return done


def _below(file: UrdfFile, first: Joint) -> list[Joint]:
    """Return `first` and every joint below it."""
    joints = [first]
    for joint in joints:
        joints += file.joints_below[joint.child]
    return joints


def links_below(file: UrdfFile, joint: Joint) -> tuple[str, ...]:
    """Return the links that a joint carries, nearest first."""
    return tuple(below.child for below in _below(file, joint))


def _own_base(file: UrdfFile, parents: dict[str, Joint], first: Joint) -> list[str]:
    """Return names of fixed joints and links between the trunk and a limb that carry it alone."""
    names: list[str] = []
    link = first.parent
    while link in parents and len(file.joints_below[link]) == 1:
        names += [parents[link].name, link]
        link = parents[link].parent
    return names


def _carrier(file: UrdfFile, link: str) -> Joint:
    """Return the moved joint nearest above a link that is not fixed to the root."""
    parents = {joint.child: joint for joint in file.joints}
    joint = parents[link]
    while not joint.moves:
        joint = parents[joint.parent]
    return joint
