"""A leg that another count of joints, another direction or no weight tells from the others.

Legs stand around a trunk, point away from it, move equally many joints and carry motors. A file in
which one does otherwise walks, but as a robot that nobody built.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from statistics import median

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile
from hexapod_pin.robot.recognition.legs import FEWEST
from hexapod_pin.robot.repair import rules
from hexapod_pin.robot.repair.doubts import LIGHT_LEGS, UNLIKE, grams
from hexapod_pin.robot.repair.finding import Finding
from hexapod_pin.robot.repair.measures import Measures
from hexapod_pin.robot.repair.structure import trunk_links, trunk_root

FEWEST_LIKE = 4
"""Legs of which one can be unlike the others (*assumed*)."""


def layout_findings(measures: Measures) -> Iterator[Finding]:
    """Yield a finding for legs of other counts, directions or weights than a robot's."""
    yield from _counts(measures)
    yield from _inward(measures)
    yield from _light(measures)


def _counts(measures: Measures) -> Iterator[Finding]:
    """Yield that a leg moves other joints than all others.

    Either one carries joints that another one lacks, as a parent is the wrong link's; or the others
    are of an odd number, and it starts among them, as a joint or a link of it is missing.
    """
    file = measures.file
    root = trunk_root(file)
    trunk = set() if root is None else set(trunk_links(file, root))
    counts = {
        joint.child: sum(x.moves for x in _joints_below(file, joint))
        for joint in file.joints
        if joint.moves and joint.parent in trunk
    }
    if len(counts) < FEWEST_LIKE:
        return
    usual = int(median(counts.values()))
    odd = {name: count for name, count in counts.items() if count != usual}
    if len(odd) == 2 and sum(odd.values()) == 2 * usual:
        full, bare = sorted(odd, key=lambda name: -odd[name])
        value = f"moves {odd[full]} joints, {bare} {odd[bare]}, {usual} in other legs"
        yield _by_hand(f"link {full!r}", value, "correct the parent of a joint by hand")
        return
    legs = [name for name in counts if name not in odd]
    if len(legs) < FEWEST_LIKE - 1 or not len(legs) % 2:
        return
    short = [name for name in odd if odd[name] < usual and _among(measures, name, legs)]
    if len(short) == 1 and not _evened(usual, odd[short[0]]):
        count = odd[short[0]]
        value = f"moves {count} joint{'s' * (count > 1)}, {usual} in other legs"
        yield _by_hand(f"link {short[0]!r}", value, "correct its joints by hand")


def _evened(usual: int, count: int) -> bool:
    """Return whether the legs are recognised with a joint of the others held."""
    return usual > FEWEST and count == usual - 1


def _by_hand(where: str, value: str, repair: str) -> Finding:
    return Finding(
        UNLIKE, where, value, "legs are alike", repair, "suspicious", repairable=False
    )  # fmt: skip


def _joints_below(file: UrdfFile, joint: Joint) -> list[Joint]:
    """Return a joint and all that it carries."""
    found, seen = [joint], {joint.child}
    for one in found:
        below = [x for x in file.joints_below.get(one.child, ()) if x.child not in seen]
        seen.update(x.child for x in below)
        found += below
    return found


OFF_PLANE = 0.1
"""Distance from the plane of the hips over their least distance from the middle, within which a
limb starts where legs do (*assumed*): heads and arms stand above."""

NEARER, FARTHER = 0.8, 1.25
"""Its distance from the middle over the least and the largest one of the hips (*assumed*)."""


def _among(measures: Measures, name: str, legs: list[str]) -> bool:
    """Return whether a limb starts in the plane of the hips, as far from their middle."""
    places = measures.places
    if name not in places or not all(leg in places for leg in legs):
        return False
    hips = np.array([places[leg][1] for leg in legs])
    axes, middle = _plane(hips)
    far = np.linalg.norm((hips - middle) @ axes[:2].T, axis=1)
    own = axes @ (places[name][1] - middle)
    out, off = float(np.linalg.norm(own[:2])), abs(float(own[2]))
    least, most = float(far.min()), float(far.max())
    return off < OFF_PLANE * least and NEARER * least < out < FARTHER * most


def _plane(hips: Array) -> tuple[Array, Array]:
    """Return axes (3, 3) of hips (n, 3), the last one across their plane, and their middle."""
    middle = hips.mean(axis=0)
    return np.linalg.svd(hips - middle)[2], middle


OUT = 0.2
"""Cosine between a leg and the line from the middle of the hips to its own, from which it points
away from the trunk, and minus which towards it (*assumed*): 16 robots have 0.3 to 1."""

TURNS_ROUND = 0.5 * math.pi
"""Angle by which a first joint may turn a leg round, whatever its zero [rad]."""


def _inward(measures: Measures) -> Iterator[Finding]:
    """Yield that one leg points into the trunk, all others away from it, with joints at zero."""
    places = measures.places
    legs = [x for x in measures.chains if len(x) > 1 and all(j.child in places for j in x)]
    if len(legs) < FEWEST_LIKE:
        return
    hips = np.array([places[leg[0].child][1] for leg in legs])
    axes, middle = _plane(hips)
    ends = np.array([_end(measures, leg) for leg in legs])
    ahead, out = (ends - hips) @ axes[:2].T, (hips - middle) @ axes[:2].T
    sizes = np.linalg.norm(ahead, axis=1) * np.linalg.norm(out, axis=1)
    if not sizes.min() > 0.0:
        return
    cosines = np.sum(ahead * out, axis=1) / sizes
    inward = np.flatnonzero(cosines < -OUT)
    if len(inward) != 1 or np.count_nonzero(cosines > OUT) != len(legs) - 1:
        return
    joint = legs[inward[0]][0]
    if max(-joint.limit("lower", 0.0), joint.limit("upper", 0.0)) > TURNS_ROUND:
        return
    value = "its leg points into the trunk, the others away from it"
    yield _by_hand(f"joint {joint.name!r}", value, "correct the angles of its <origin> by hand")


def _end(measures: Measures, leg: tuple[Joint, ...]) -> Array:
    """Return the frame of a leg's last body that is farthest from its last joint [m]."""
    places, last = measures.places, leg[-1].child
    frames = [places[x][1] for x in measures.file.rigid_group(last) if x in places]
    return max(frames, key=lambda place: float(np.linalg.norm(place - places[last][1])))


def _light(measures: Measures) -> Iterator[Finding]:
    """Yield that legs weigh less than the motors beyond their first joints, in a heavier robot."""
    file, total = measures.file, measures.total_mass
    legs = [x for x in measures.chains if len(x) > 1]
    motors = sum(len(leg) - 1 for leg in legs)
    names = {name for leg in legs for joint in leg for name in file.rigid_group(joint.child)}
    own = math.fsum(file.link_by_name[x].mass or 0.0 for x in names if x in file.link_by_name)
    least = rules.MOTOR_MASS[0] * motors
    if len(legs) < FEWEST_LIKE or not 0.0 < own < min(least, LIGHT * total):
        return
    value = f"{grams(own)}, {grams(least)} is least with {motors} motors in them"
    yield Finding(
        LIGHT_LEGS, "robot", value, "legs carry their motors", "give links their own masses",
        "suspicious", repairable=False,
    )  # fmt: skip


LIGHT = 0.05
"""Mass of all legs over that of the robot below which the trunk may have been given theirs
(*assumed*): 15 robots have 0.32 to 0.89."""
