"""Legs are chains of moved joints that start at the trunk, whatever their names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import TURNING, Joint, UrdfFile
from hexapod_pin.robot.rotations import rotation
from hexapod_pin.robot.serial_chain import JointAxis

MOST_JOINTS = 5
LEG_COUNTS = (4, 5, 6, 7, 8)

UNLIKE = 0.35
"""A chain whose links differ from those of the others by more than this share of the chain's
length is no leg (*assumed*)."""

NEAR_PARALLEL = 0.05
"""Sine below which axes are parallel: angles in a file are rounded, such as 3.14 (*assumed*)."""


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
    """Return whether a joint can be one of a leg."""
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
    lengths = np.array([_links(_axes(chain, frames), tips[chain.label]) for chain in best])
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
    """Return what was found instead of legs, and a remedy."""
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


# Poses of all links and joints in the root link's frame, from a URDF's tree alone.

SLIDING = ("prismatic",)


class Pose(NamedTuple):
    """A frame in the root link's frame: rotation (3, 3) and position (3,) [m]."""

    rotation: Array
    position: Array

    def act(self, points: Array) -> Array:
        """Return points (..., 3) of this frame in the root link's frame [m]."""
        moved: Array = points @ self.rotation.T + self.position
        return moved

    def into(self, points: Array) -> Array:
        """Return points (..., 3) of the root link's frame in this frame [m]."""
        moved: Array = (points - self.position) @ self.rotation
        return moved


class Axis(NamedTuple):
    """A joint's axis in the root link's frame: a point on it [m] and its unit direction."""

    origin: Array
    unit: Array

    def arm(self, points: Array) -> Array:
        """Return the perpendiculars (..., 3) from the axis to points (..., 3) [m]."""
        offset = points - self.origin
        across: Array = offset - (offset @ self.unit)[..., None] * self.unit
        return across

    def turned(self, points: Array, angle: float) -> Array:
        """Return points (..., 3) turned about the axis by an angle [rad]."""
        return JointAxis.of(self.unit, self.origin).turned(points, angle)


@dataclass(frozen=True, eq=False)
class TreeFrames:
    """Poses in the root link's frame.

    Attributes:
        links: pose of every link.
        axes: axis of every moved joint.
    """

    links: Mapping[str, Pose]
    axes: Mapping[str, Axis]


def tree_frames(file: UrdfFile, places: Mapping[str, float] = MappingProxyType({})) -> TreeFrames:
    """Return the poses of all links and moved joints.

    Args:
        file: a URDF whose tree is sound (`check_tree`).
        places: joint name -> angle or travel [rad or m]; the others are at zero.

    Raises:
        UrdfError: a moved joint without an axis.
    """
    links = {file.base: Pose(np.eye(3), np.zeros(3))}
    axes: dict[str, Axis] = {}
    reached = [file.base]
    for name in reached:
        for joint in file.joints_below[name]:
            parent = links[name]
            turn = parent.rotation @ rotation(joint.rpy)
            pose = Pose(turn, parent.act(np.array(joint.xyz)))
            if joint.moves:
                axes[joint.name] = Axis(pose.position, turn @ unit_axis(file, joint))
                pose = _moved(joint, axes[joint.name], pose, places.get(joint.name, 0.0))
            links[joint.child] = pose
            reached.append(joint.child)
    return TreeFrames(links, axes)


def check_tree(file: UrdfFile) -> None:
    """Refuse what is no tree of links: the rest of recognition relies on it.

    Raises:
        UrdfError: naming each link or joint: no or several roots, links with two parents or
            without a <link>, numbers that cannot be read.
    """
    known = {link.name for link in file.links}
    counts = Counter(joint.child for joint in file.joints)
    findings = [
        f"joint {joint.name!r}: its {end} link {name!r} does not exist; declare it or correct it"
        for joint in file.joints
        for end, name in (("parent", joint.parent), ("child", joint.child))
        if name not in known
    ]
    roots = [link.name for link in file.links if link.name not in counts]
    if len(roots) != 1:
        text = ", ".join(roots) if roots else "none"
        findings.append(f"root links: {text}; must be exactly one: join the parts by fixed joints")
    findings += [
        f"link {name!r}: child of {count} joints; must be of one: a loop is no tree"
        for name, count in counts.items()
        if count > 1
    ]
    findings += [
        f"joint {joint.name!r}: origin or axis has missing or non-finite numbers; give three each"
        for joint in file.joints
        if not np.isfinite([*joint.xyz, *joint.rpy, *(joint.axis if joint.moves else ())]).all()
    ]
    if not findings and (lost := _unreached(file)):
        findings.append(f"links {lost}: on a loop of joints; the links must form a tree")
    if findings:
        raise UrdfError(file.source, findings)


def unit_axis(file: UrdfFile, joint: Joint) -> Array:
    """Return the unit axis (3,) of a moved joint in its own frame."""
    axis = np.array(joint.axis)
    size = float(np.linalg.norm(axis))
    if size == 0 and joint.kind in (*TURNING, *SLIDING):
        raise UrdfError(file.source, [f"joint {joint.name!r}: axis (0, 0, 0); give it a direction"])
    return axis / size if size else np.array([1.0, 0.0, 0.0])


def _moved(joint: Joint, axis: Axis, pose: Pose, place: float) -> Pose:
    """Return a joint's child frame at a place of the joint."""
    if place == 0 or joint.kind not in (*TURNING, *SLIDING):
        return pose
    if joint.kind in SLIDING:
        return Pose(pose.rotation, pose.position + place * axis.unit)
    columns = Axis(np.zeros(3), axis.unit).turned(pose.rotation.T, place)
    return Pose(columns.T, pose.position)


def _unreached(file: UrdfFile) -> str:
    """Return the links that the root does not lead to."""
    reached = {file.base}
    for first in file.joints_below[file.base]:
        reached.update(links_below(file, first))
    return ", ".join(repr(link.name) for link in file.links if link.name not in reached)


# Which joints of a leg walk: all of two or three; of four or five the three that do most.

WALKING = 3
"""Joints that place a foot in space."""

PARALLEL = 0.98
"""Least |cosine| of axes that are taken for parallel (11 deg)."""


def walking_joints(
    chains: Sequence[Chain], frames: TreeFrames, tips: dict[str, Array], up: Array
) -> tuple[tuple[int, ...], str]:
    """Return the places of the joints that walk in every leg, and a sentence if some are held.

    Of more than three joints: the pair of parallel neighbours (hip pitch and knee) with the
    longest links between and beyond them, and before them the joint nearest to upright (yaw).
    Only distances of axes enter, so the choice is the same for any zero posture.
    """
    count = len(chains[0].joints)
    if count <= WALKING:
        return tuple(range(count)), ""
    axes = [_axes(chain, frames) for chain in chains]
    run = _parallel_run(axes[0])
    links = np.mean([_links(a, tips[c.label]) for a, c in zip(axes, chains, strict=True)], axis=0)
    pairs = [(i, j) for i in run for j in run if i < j]
    pair = max(pairs, key=lambda pair: _worth(pair, links), default=(1, 2))
    before = [k for k in range(pair[0]) if k not in run]
    upright = [(round(abs(float(axes[0][k].unit @ up)), 3), -k, k) for k in before]
    rest = [k for k in range(count) if k not in pair]
    first = max(upright)[2] if upright else rest[0]
    chosen = tuple(sorted((first, *pair)))
    walk, held = (
        ", ".join(joint.name for k, joint in enumerate(chains[0].joints) if (k in chosen) is yes)
        for yes in (True, False)
    )
    return chosen, (
        f"of {count} joints a leg the three with the longest links between them walk ({walk});"
        f" the others are held ({held})"
    )


def _parallel_run(axes: Sequence[Axis]) -> list[int]:
    """Return the longest run of neighbours whose axes are parallel; the first of equal ones."""
    runs, run = [], [0]
    for k in range(1, len(axes)):
        if abs(float(axes[k].unit @ axes[k - 1].unit)) >= PARALLEL:
            run.append(k)
        else:
            runs.append(run)
            run = [k]
    runs.append(run)
    return max(runs, key=len)


def _axes(chain: Chain, frames: TreeFrames) -> list[Axis]:
    return [frames.axes[joint.name] for joint in chain.joints]


def _links(axes: Sequence[Axis], tip: Array) -> list[float]:
    """Return the distance of each axis to the next one, of the last one to the tip [m]."""
    between = [axis_distance(a, b) for a, b in zip(axes, axes[1:], strict=False)]
    return [*between, float(np.linalg.norm(axes[-1].arm(tip)))]


def _worth(pair: tuple[int, int], links: Array) -> tuple[float, int]:
    """Order pairs by the shorter of their two links (to 1 %), then the inner one first."""
    i, j = pair
    shorter = min(links[i:j].sum(), links[j:].sum())
    return round(float(shorter / links.sum()), 2), -i
