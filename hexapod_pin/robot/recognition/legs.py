"""Limbs are taken as legs by their likeness, or as the user names them; each has a last body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.recognition.chains import (
    LEG_COUNTS,
    MOST_JOINTS,
    Axis,
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
from hexapod_pin.robot.recognition.shape_points import FlatEnd, link_shapes

if TYPE_CHECKING:
    from hexapod_pin.robot.reading.resources import ResourceFinder


# The last body of a leg: everything beyond its last turning joint, as shapes in one frame.

NOTHING = 1e-9
"""A shape that reaches no further than this from the last joint's axis shows no foot [m]."""


class BodySphere(NamedTuple):
    """A sphere on a leg's last body, root link's frame.

    Attributes:
        link: that carries it.
        centre: [m]. Shape (3,).
        radius: [m].
        stated: whether it is the link's first collision sphere: the file's own foot sphere.
    """

    link: str
    centre: Array
    radius: float
    stated: bool


class BodyEnd(NamedTuple):
    """An end face of a cylinder on a leg's last body, root link's frame."""

    link: str
    face: FlatEnd


@dataclass(frozen=True, eq=False)
class LegBody:
    """Shapes beyond a leg's last turning joint at q = 0, root link's frame.

    Attributes:
        chain: the leg.
        axis: of its last turning joint.
        points: vertices [m]. Shape (N, 3).
        owners: index into `chain.body` of the link of each point. Shape (N,).
        spheres: exact spheres.
        ends: end faces of cylinders.
        lost: why meshes give no points.
    """

    chain: Chain
    axis: Axis
    points: Array
    owners: Array
    spheres: tuple[BodySphere, ...]
    ends: tuple[BodyEnd, ...]
    lost: tuple[str, ...]

    @property
    def empty(self) -> bool:
        """Whether there is no shape away from the last joint's axis."""
        return self.reach <= NOTHING

    @property
    def reach(self) -> float:
        """Largest distance of any shape from the axis of the last joint [m]."""
        across = np.linalg.norm(self.axis.arm(self.points), axis=1)
        balls = [np.linalg.norm(self.axis.arm(s.centre)) + s.radius for s in self.spheres]
        return float(max([*across, *balls], default=0.0))

    def furthest(self) -> Array:
        """Return the unit direction from the last joint's axis to the furthest shape. (3,)."""
        arms = self.axis.arm(self.points)
        balls = [self.axis.arm(s.centre) for s in self.spheres]
        across = np.linalg.norm(arms, axis=1)
        sizes = [
            float(np.linalg.norm(a)) + s.radius for a, s in zip(balls, self.spheres, strict=True)
        ]
        reach = self.reach
        near = [a for a, s in zip(balls, sizes, strict=True) if s > 0.98 * reach]
        near += list(arms[across > 0.98 * reach])
        return _unit(np.sum([_unit(arm) for arm in near], axis=0) + np.zeros(3))


def _unit(vector: Array) -> Array:
    """Return a vector (3,) at unit length; zeros for zeros, as of a shape on the axis."""
    size = float(np.linalg.norm(vector))
    return vector / size if size > 0.0 else np.zeros(3)


def leg_body(file: UrdfFile, finder: ResourceFinder, frames: TreeFrames, chain: Chain) -> LegBody:
    """Return the shapes beyond a leg's last turning joint."""
    points, owners = [np.zeros((0, 3))], [np.zeros(0, dtype=int)]
    spheres: list[BodySphere] = []
    ends: list[BodyEnd] = []
    lost: list[str] = []
    for index, link in enumerate(chain.body):
        shapes, pose = link_shapes(file, finder, link), frames.links[link]
        points.append(pose.act(shapes.points))
        owners.append(np.full(len(shapes.points), index))
        stated = file.link_by_name[link].collision_sphere
        for sphere in shapes.spheres:
            own = (
                stated is not None
                and sphere.radius == stated.radius
                and np.allclose(sphere.centre, stated.centre, rtol=0, atol=1e-12)
            )
            spheres.append(BodySphere(link, pose.act(sphere.centre), sphere.radius, own))
        for end in shapes.ends:
            face = FlatEnd(pose.act(end.centre), pose.rotation @ end.normal, end.radius, end.depth)
            ends.append(BodyEnd(link, face))
        lost += shapes.lost
    return LegBody(
        chain, frames.axes[chain.joints[-1].name], np.vstack(points), np.concatenate(owners),
        tuple(spheres), tuple(ends), tuple(lost),
    )  # fmt: skip


# Which limbs are the legs: by their likeness, or as the user names them.


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
        UrdfError: other limbs, naming them and the way out; given legs that are none.
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
    labels = [chain.label for chain in found]
    if not findings and len(set(labels)) < len(labels):
        findings.append("legs=[...]: two legs on the same limb; name each limb once")
    counts = {len(chain.joints) for chain in found}
    if not findings and (len(counts) != 1 or not 2 <= min(counts) <= MOST_JOINTS):
        findings.append(
            f"legs=[...]: legs of {sorted(counts)} joints; all must have 2 to 5, the same"
        )
    if not findings and len(found) not in LEG_COUNTS:
        findings.append(f"legs=[...]: {len(found)} legs; must be 4 to 8")
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
"""Joints that a leg must keep."""

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
    """Tell whether the distances of successive axes are the same in all limbs."""
    axes = [[frames.axes[joint.name] for joint in chain.joints] for chain in chains]
    links = np.array([[axis_distance(*p) for p in zip(a, a[1:], strict=False)] for a in axes])
    size = float(np.median(links.sum(axis=1)))
    return bool(np.abs(links - np.median(links, axis=0)).max() <= SAME_LINKS * size)
