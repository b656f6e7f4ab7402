"""A leg that another count of joints, another direction or no weight tells from the others.

Legs stand around a trunk, point away from it, move equally many joints and carry motors. A file in
which one does otherwise walks, but as a robot that nobody built.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from statistics import median, median_low

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile
from hexapod_pin.robot.recognition.chains import LEG_COUNTS
from hexapod_pin.robot.recognition.legs import FEWEST
from hexapod_pin.robot.repair import rules
from hexapod_pin.robot.repair.doubts import LIGHT_LEGS, UNLIKE, grams
from hexapod_pin.robot.repair.finding import Finding
from hexapod_pin.robot.repair.measures import Measures
from hexapod_pin.robot.repair.structure import trunk_links, trunk_root

Flags = NDArray[np.bool_]
"""An array of truths."""

FEWEST_LIKE = 4
"""Legs of which one can be unlike the others (*assumed*)."""


def layout_findings(measures: Measures, moved: Sequence[Joint]) -> Iterator[Finding]:
    """Yield a finding for legs of other counts, directions or weights than a robot's.

    Args:
        measures: of the robot.
        moved: joints at another distance from their neighbours than in other legs, which is said.
    """
    yield from _counts(measures)
    yield from _types(measures)
    yield from _mirror(measures, moved)
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


SLIDING = {"revolute", "prismatic"}
"""Types of a joint of which one leg has the other one: it is taken for no leg."""


def _types(measures: Measures) -> Iterator[Finding]:
    """Yield that a joint of one leg slides where those of all others, an odd number, turn."""
    for count in {len(chain) for chain in measures.chains}:
        for joints in zip(*(x for x in measures.chains if len(x) == count), strict=True):
            types = [joint.kind for joint in joints]
            usual = max(types, key=types.count)
            odd = [joint for joint in joints if joint.kind != usual]
            others = len(joints) - len(odd)
            if len(odd) == 1 and set(types) == SLIDING and others >= FEWEST_LIKE - 1 and others % 2:
                value = f"type {odd[0].kind}, {usual} in other legs"
                yield _by_hand(f"joint {odd[0].name!r}", value, "correct its type by hand")


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


NEAR, FAR = 0.05, 0.15
"""Distance of a mirrored hip from the nearest hip over the size of the layout, within which it has
a partner, and from which it has none (*assumed*)."""

ALIKE, TURNED = 0.2, 1.0
"""Angle between a mirrored leg and its partner, within which they agree, and from which one is
turned, with joints at zero (*assumed*) [rad]."""

FEWEST_MIRRORED = 6
"""Hips of which one can be out of place: the line between two others mirrors a third pair."""

TURNS_ROUND = 0.5 * math.pi
"""Angle by which a first joint may turn a leg, whatever its zero [rad]."""


def _mirror(measures: Measures, moved: Sequence[Joint]) -> Iterator[Finding]:
    """Yield that one leg starts at another place, or points elsewhere, than mirrored legs do."""
    places = measures.places
    if not all(math.isfinite(x) for one in measures.file.joints for x in (*one.xyz, *one.rpy)):
        return  # that is said
    legs = [x for x in measures.chains if len(x) > 1 and all(j.child in places for j in x)]
    usual = median_low([len(leg) for leg in legs]) if legs else 0
    legs = [leg for leg in legs if len(leg) == usual]  # heads and arms have other counts
    if not FEWEST_LIKE <= len(legs) <= max(LEG_COUNTS) or not measures.plausible_size:
        return
    hips = np.array([places[leg[0].child][1] for leg in legs])
    axes, middle = _plane(hips)
    ends = np.array([end_of(measures, leg[-1]) for leg in legs])
    z, w = ((x @ axes[0] + 1j * (x @ axes[1])) for x in (hips - middle, ends - hips))
    out_of_place, turned = _odd_legs(z, w)
    if out_of_place and len(legs) >= FEWEST_MIRRORED and not len(legs) % 2:
        value = f"{_named(legs, out_of_place)} where no leg mirrors it"
        where = f"joint {legs[out_of_place[0]][0].name!r}"
        yield _by_hand(where, value, "correct its <origin> by hand")
    inward = [k for k in turned if _cosine(w[k], z[k]) < -OUT]
    turned = inward if len(inward) == 1 else turned
    joints = [legs[k][0] for k in turned]
    reach = [max(-x.limit("lower", 0.0), x.limit("upper", 0.0)) for x in joints]
    if joints and max(reach) < TURNS_ROUND:
        value = "its leg points into the trunk" if inward else "its leg points elsewhere"
        value += ", the others away from it" if inward else " than its mirror image"
        cure = "correct the angles of its <origin> by hand"
        yield _by_hand(f"joint {joints[0].name!r}", value, cure)
    if not any(joint in leg for joint in moved for leg in legs):
        yield from _folded(legs, ends - hips, axes[2], np.abs(w))


SAME_SHAPE, OTHER_SHAPE = 0.05, 0.25
"""Distance of a leg's end from where the others have theirs, with joints at zero, over how far it
is from the hip: within which they agree, and from which one is folded otherwise (*assumed*)."""


def _folded(
    legs: Sequence[Sequence[Joint]], ahead: Array, up: Array, out: Array
) -> Iterator[Finding]:
    """Yield that one leg, with joints at zero, ends at another height, or nearer to its hip.

    Args:
        legs: their joints.
        ahead: from the hips to the ends [m]. Shape (n, 3).
        up: across the plane of the hips. Shape (3,).
        out: distance of the ends from the hips in it [m]. Shape (n,).
    """
    shapes = np.column_stack([ahead @ up, out])
    off = np.linalg.norm(shapes - np.median(shapes, axis=0), axis=1)
    far = float(np.median(np.linalg.norm(ahead, axis=1)))
    odd = np.flatnonzero(off > OTHER_SHAPE * far)
    if len(odd) == 1 and np.delete(off, odd[0]).max() < SAME_SHAPE * far:
        (height, reach), (usual, others) = shapes[odd[0]], np.median(shapes, axis=0)
        value = f"its leg ends {abs(height - usual):.2g} m above or below the others at zero angles"
        if abs(reach - others) > abs(height - usual):
            value = f"its leg ends {reach:.2g} m out at zero angles, the others {others:.2g} m"
        cure = "correct the <origin> of one of its joints by hand"
        yield _by_hand(f"joint {legs[odd[0]][0].name!r}", value, cure)


def _named(legs: Sequence[Sequence[Joint]], found: Sequence[int]) -> str:
    """Return "starts", of two legs with the name of the other."""
    return "starts" if len(found) == 1 else f"or {legs[found[1]][0].name!r} starts"


OUT = 0.2
"""Cosine between a leg and the line from the middle of the hips, minus which it points inwards."""


def _cosine(one: complex, other: complex) -> float:
    """Return the cosine of the angle between two directions in a plane; 0 of none."""
    size = abs(one) * abs(other)
    return (one * other.conjugate()).real / size if size > 0.0 else 0.0


def _odd_legs(z: Array, w: Array) -> tuple[list[int], list[int]]:
    """Return legs whose hips no line mirrors to others, and those that point elsewhere than theirs.

    A line that mirrors all but two legs at most counts against these, and for those that it
    mirrors to others. The line that mirrors z_i to z_j is across their distance.

    Args:
        z: hips in their plane as complex numbers [m]. Shape (n,).
        w: from the hips to the ends of the legs, likewise. Shape (n,).
    """
    size = math.sqrt(float(np.mean(np.abs(z) ** 2)))
    i, j = np.triu_indices(len(z), 1)
    far = np.abs(z[j] - z[i]) > NEAR * size
    i, j = i[far], j[far]
    apart, middle = z[j] - z[i], 0.5 * (z[i] + z[j])[:, None]
    turn = -((apart / np.abs(apart)) ** 2)[:, None]
    off = np.abs((middle + turn * np.conj(z - middle))[..., None] - z)  # (lines, n, n)
    partner, off = off.argmin(axis=2), off.min(axis=2)
    odd, others = off > NEAR * size, partner != np.arange(len(z))
    whole = ~odd.any(axis=1)
    places = _against(odd, others, ~whole & (off.max(axis=1) > FAR * size))
    directions = list[int]()
    if np.abs(w).min() > NEAR * size:
        angle = np.abs(np.angle(turn * np.conj(w) / w[partner]))
        sure = np.all((angle > TURNED) | (angle < ALIKE), axis=1)
        directions = _against(angle > TURNED, others, whole & sure)
    return [] if whole.any() else places, directions


def _against(odd: Flags, others: Flags, lines: Flags) -> list[int]:
    """Return the legs that lines count against, and none for.

    Args:
        odd: by each line. Shape (lines, n).
        others: whether a line mirrors a leg to another one. Shape (lines, n).
        lines: that are asked, if they count against few. Shape (lines,).
    """
    lines = lines & (odd.sum(axis=1) <= MOST_ODD)
    found = np.flatnonzero(odd[lines].any(axis=0) & ~np.any(~odd[lines] & others[lines], axis=0))
    return found.tolist() if len(found) <= MOST_ODD else []


MOST_ODD = 2
"""Legs that one wrong leg makes odd: itself and its partner."""


def end_of(measures: Measures, joint: Joint) -> Array:
    """Return the frame of the body that a joint moves which is farthest from the joint [m]."""
    places, last = measures.places, joint.child
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
