"""A part of one leg that is unlike the same part of all other legs is a slip of the file.

The k-th joints of chains of equally many joints, and the bodies that they move, are alike: legs are
copies of each other, at most mirrored. One that differs much while the others agree shows a unit, a
digit or a line that was changed in one leg alone.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from hexapod_pin.robot.description.solids import finite
from hexapod_pin.robot.description.urdf_file import Joint, length
from hexapod_pin.robot.repair import rules
from hexapod_pin.robot.repair.doubts import UNLIKE
from hexapod_pin.robot.repair.finding import Draft, Finding, number
from hexapod_pin.robot.repair.leg_layout import FEWEST_LIKE, end_of, layout_findings
from hexapod_pin.robot.repair.measures import Measures

MUCH_UNLIKE = 3.0
"""Ratio of two numbers of one kind from which they differ, and within which they agree (*assumed*):
motors and links of the legs of one robot differ less."""

SEVERAL_UNLIKE = 500.0
"""Ratio from which fewer than half of the parts differ by a unit, grams at least (*assumed*)."""

VERY_UNLIKE = 1e3
"""Ratio of two masses from which no walk is tried (*assumed*)."""

LENGTH_UNLIKE = 1.1
"""The same of the distances between joints, and to the ends of legs (*assumed*): those of 18 robots
differ by 1.2 % at most."""

LENGTH_THAT_MATTERS = 0.02
"""Difference of such a distance over the span of all joints, below which it is let pass
(*assumed*)."""

MASS_THAT_MATTERS = 0.02
"""Difference of mass over that of the robot, below which no torque depends on it (*assumed*)."""


@dataclass(frozen=True)
class Unlike:
    """A number of one leg that differs from that of all others.

    Attributes:
        joint: which has it, or moves the body that has it.
        kind: "effort", "velocity", "damping", "friction", "mass", "length", "end" or "radius".
        value: of this leg, in SI units.
        usual: median of the other legs.
    """

    joint: Joint
    kind: str
    value: float
    usual: float


WITH_ZERO = ("effort", "velocity", "end")
"""Kinds of which 0 is a number like others."""

LENGTHS = ("length", "end", "radius")
"""Kinds of the shape: distances from the joint before and from a leg's last joint to its end, and
the radius of the foot."""

UNITS = {"effort": "N m", "velocity": "rad/s", "damping": "N m s/rad", "friction": "N m"}

RESISTING = ("damping", "friction")
"""Kinds that take torque."""

RESISTS = 0.1
"""Torque that they take over what standing on three feet takes, below which they are let pass
(*assumed*): as much as geared servos have."""


def like_joints(measures: Measures) -> list[list[Joint]]:
    """Return joints that are alike: the k-th ones of chains of equally many joints."""
    places: dict[tuple[int, int], list[Joint]] = {}
    for chain in measures.chains:
        for k, joint in enumerate(chain):
            places.setdefault((len(chain), k), []).append(joint)
    return list(places.values())


def unlike_parts(measures: Measures) -> list[Unlike]:
    """Return every number of one leg that differs much from those of all other legs."""
    found: list[Unlike] = []
    lengths = _lengths(measures)
    last = {id(chain[-1]) for chain in measures.chains}
    for joints in like_joints(measures):
        if len(joints) < FEWEST_LIKE or len({joint.kind for joint in joints}) > 1:
            continue
        found += _odd(joints, "effort", [joint.limit("effort") for joint in joints])
        found += _odd(joints, "velocity", [joint.limit("velocity") for joint in joints])
        apart = _odd(joints, "length", [lengths[id(joint)] for joint in joints])
        if all(id(joint) in last for joint in joints):
            apart += _odd(joints, "end", [_end(measures, joint) for joint in joints])
            apart += _odd(joints, "radius", [_radius(measures, joint) for joint in joints])
        least = LENGTH_THAT_MATTERS * measures.span
        found += [x for x in apart if abs(x.value - x.usual) >= least]
        found += [x for kind in RESISTING for x in _resisting(measures, joints, kind)]
        masses = [_mass(measures, joint) for joint in joints]
        least = MASS_THAT_MATTERS * measures.total_mass
        found += [x for x in _odd(joints, "mass", masses) if abs(x.value - x.usual) >= least]
    return found


def unlike_findings(measures: Measures) -> Iterator[Finding]:
    """Yield a finding for every part that is unlike the same part of the other legs."""
    for axis in reversed_axes(measures):
        (low, high), (least, most) = axis.range, axis.usual
        usual = f"{least:.3g} to {most:.3g} in other legs"
        value = f"axis reversed: turns by {low:.3g} to {high:.3g} rad downwards, {usual}"
        yield Finding(
            UNLIKE, f"joint {axis.joint.name!r}", value, "legs are alike", "the axis is reversed",
            "suspicious",
        )  # fmt: skip
    parts = unlike_parts(measures)
    moved = [x.joint for x in parts if x.kind in ("length", "end")]
    yield from layout_findings(measures, moved)
    yield from _turned_axes(measures, moved)
    for one in parts:
        if one.kind == "length":
            place = f"joint {one.joint.name!r}"
            value = f"{one.value:.3g} m from the joint before it, {one.usual:.3g} m in other legs"
            repair = "check it by hand: a longer leg is possible"
        elif one.kind == "end":
            place = f"link {one.joint.child!r}"
            far = f"{one.value:.3g} m from" if one.value else "at"
            value = f"ends {far} its joint, {one.usual:.3g} m in other legs"
            repair = "check it by hand: a link may be missing beyond it"
        elif one.kind == "radius":
            place = f"link {one.joint.child!r}"
            value = f"a foot of radius {one.value:.3g} m, {one.usual:.3g} m in other legs"
            repair = "correct its collision sphere by hand"
        elif one.kind == "mass":
            place = f"link {one.joint.child!r}"
            value = f"mass {one.value:.3g} kg, {one.usual:.3g} kg in other legs"
            repair = "the mass of the other legs; its inertia in proportion"
        else:
            place = f"joint {one.joint.name!r}"
            value = f"{one.kind} {one.value:.3g} {UNITS[one.kind]}, {one.usual:.3g} in other legs"
            repair = f"the {one.kind} of the other legs"
        alike = one.usual / VERY_UNLIKE < one.value < one.usual * VERY_UNLIKE
        refused = one.kind == "mass" and not alike  # a walk would take hours
        yield Finding(
            f"mass {UNLIKE}" if refused else UNLIKE, place, value, "legs are alike", repair,
            "refused" if refused else "suspicious", repairable=one.kind not in LENGTHS,
        )  # fmt: skip


@dataclass(frozen=True)
class ReversedAxis:
    """A joint that turns the other way than the same joint of all other legs.

    Attributes:
        joint: the joint.
        range: in which it turns, downwards > 0 [rad].
        usual: the same of other legs.
    """

    joint: Joint
    range: tuple[float, float]
    usual: tuple[float, float]


UP = np.array([0.0, 0.0, 1.0])
"""Upward direction, in the root's frame: legs of other files are not judged."""

PITCH = 0.7
"""Cosine of the angle between an axis and the horizontal across its leg, from which the joint lifts
the leg, and its sense can be compared with that of mirrored legs."""


COPIED = 0.99
"""Part of a range that legs have in common whose limits are copies of each other: where zeros of
angles differ from leg to leg, ranges cannot be compared (*assumed*)."""


def reversed_axes(measures: Measures) -> list[ReversedAxis]:
    """Return the joint of one leg that has the range of all other legs the wrong way round.

    Of joints that lift a leg: those of mirrored legs turn downwards alike, whatever their axes'
    signs. Where a range is the same both ways nothing shows, and nothing is wrong.
    """
    found = []
    legs = {id(joint): chain for chain in measures.chains for joint in chain}
    for joints in like_joints(measures):
        if len(joints) < FEWEST_LIKE:
            continue
        ranges = [(joint, _downwards(measures, legs[id(joint)], joint)) for joint in joints]
        known = [(joint, turned) for joint, turned in ranges if turned]
        if len(known) < len(joints):
            continue
        usual = tuple(float(x) for x in np.median([turned for _, turned in known], axis=0))
        odd = [(joint, x) for joint, x in known if not _alike(x, usual)]
        if len(odd) == 1 and _alike((-odd[0][1][1], -odd[0][1][0]), usual):
            found.append(ReversedAxis(*odd[0], (usual[0], usual[1])))
    return found


def _alike(one: Sequence[float], other: Sequence[float]) -> bool:
    """Return whether two ranges have nearly all of the longer one in common."""
    common = min(one[1], other[1]) - max(one[0], other[0])
    return common > COPIED * max(one[1] - one[0], other[1] - other[0])


def _downwards(
    measures: Measures, leg: Sequence[Joint], joint: Joint
) -> tuple[float, float] | None:
    """Return the range of a joint that lifts its leg, downwards > 0 [rad]; None of others."""
    lower, upper = joint.limit("lower"), joint.limit("upper")
    places = [measures.places[x.child] for x in leg if x.child in measures.places]
    if joint.kind != "revolute" or len(places) < 2 or not lower < upper:
        return None
    ahead = (places[-1][1] - places[0][1]) * (1.0 - UP)
    across = np.cross(UP, ahead)
    axis = measures.places[joint.child][0] @ np.array(finite(joint.axis))
    size = float(np.linalg.norm(across) * np.linalg.norm(axis))
    cosine = float(across @ axis) / size if size > 0.0 else 0.0
    if abs(cosine) < PITCH:
        return None
    return (lower, upper) if cosine > 0.0 else (0.0 - upper, 0.0 - lower)


MUCH_TURNED, LITTLE_TURNED = 0.5, 0.1
"""Difference of the cosine between two lines of a leg from those of the other legs, from which it
is turned, and within which the others agree (*assumed*)."""


def _turned_axes(measures: Measures, moved: Sequence[Joint]) -> Iterator[Finding]:
    """Yield the joint of one leg whose axis has another direction than that of all other legs.

    Compared are the angles of an axis with the axes of its neighbours and with the line to the next
    joint: those of mirrored legs are the same. A leg with a joint that is
    `moved` is left out.
    """
    cosines = _cosines(measures)
    legs = {id(joint): chain for chain in measures.chains for joint in chain}
    turned: list[tuple[bool, int, Joint]] = []
    for joints in like_joints(measures):
        if len(joints) < FEWEST_LIKE or not all(id(joint) in cosines for joint in joints):
            continue
        rows = np.array([cosines[id(joint)] for joint in joints])
        off = np.abs(rows - np.median(rows, axis=0))
        odd = np.flatnonzero(off.max(axis=1) > MUCH_TURNED)
        if len(odd) == 1 and np.delete(off, odd[0], axis=0).max() < LITTLE_TURNED:
            joint, count = joints[odd[0]], int(np.sum(off[odd[0]] > MUCH_TURNED))
            turned.append((joint.element.find("axis") is None, count, joint))
    owners = {id(legs[id(joint)]) for *_, joint in turned}
    if len(owners) != 1 or owners & {id(legs[id(joint)]) for joint in moved}:
        return
    bare, _, joint = max(turned, key=lambda one: one[:2])
    about = " ".join(f"{x:g}" for x in joint.axis)
    why = " as it has no <axis>" if bare else ""
    yield Finding(
        UNLIKE, f"joint {joint.name!r}", f"turns about {about}{why}, otherwise in other legs",
        "legs are alike", "correct its <axis> by hand", "suspicious", repairable=False,
    )  # fmt: skip


LEAST_LINE = 0.02
"""Distance of two joints over the span of all joints, from which the line between them counts."""


def _cosines(measures: Measures) -> dict[int, tuple[float, float, float]]:
    """Return |cos| of joints' axes with those of their neighbours and with the line to the next.

    By `id`; 1 where there is no neighbour, 0 where there is no line.
    """
    found: dict[int, tuple[float, float, float]] = {}
    for chain in measures.chains:
        if not all(joint.child in measures.places for joint in chain):
            continue
        placed = [measures.places[joint.child] for joint in chain]
        turns = zip(placed, chain, strict=True)
        axes = [_unit((turn @ finite(joint.axis)).tolist()) for (turn, _), joint in turns]
        points = [place.tolist() for _, place in placed]
        for k, joint in enumerate(chain):
            before = _dot(axes[k], axes[k - 1]) if k else 1.0
            after, along = 1.0, 0.0
            if k + 1 < len(chain):
                after = _dot(axes[k], axes[k + 1])
                line = [b - a for a, b in zip(points[k], points[k + 1], strict=True)]
                if math.hypot(*line) > LEAST_LINE * measures.span:
                    along = _dot(axes[k], _unit(line))
            found[id(joint)] = (before, after, along)
    return found


def _unit(vector: Sequence[float]) -> list[float]:
    size = math.hypot(*vector)
    return [x / size if size > 0.0 else 0.0 for x in vector]


def _dot(one: Sequence[float], other: Sequence[float]) -> float:
    return abs(math.fsum(x * y for x, y in zip(one, other, strict=True)))


def repair_unlike(draft: Draft) -> None:
    """Give a part that is unlike the same part of the other legs their number."""
    measures = draft.measures
    for odd in reversed_axes(measures):
        element = odd.joint.element.find("axis")
        if element is not None:
            element.set("xyz", " ".join(number(-x) for x in odd.joint.axis))
            draft.change(f"joint {odd.joint.name!r}", "axis reversed, as in the other legs")
    for one in unlike_parts(measures):
        if one.kind in LENGTHS:
            continue
        if one.kind == "mass":
            _repair_mass(draft, measures, one)
            continue
        limit = one.joint.element.find("dynamics" if one.kind in RESISTING else "limit")
        if limit is not None:
            limit.set(one.kind, number(one.usual))
            text = f"{one.kind} {one.value:g} -> {one.usual:g} {UNITS[one.kind]}"
            draft.change(f"joint {one.joint.name!r}", text, f"{one.kind} of the other legs")


def _repair_mass(draft: Draft, measures: Measures, one: Unlike) -> None:
    """Scale the masses of a body, and inertias that grew with them, to those of the other legs."""
    usual = _moment(measures, one)
    for name in measures.file.rigid_group(one.joint.child):
        link = measures.file.link_by_name[name]
        inertial = link.element.find("inertial")
        mass = None if inertial is None else inertial.find("mass")
        if inertial is None or mass is None or not link.mass:
            continue
        factor = one.usual / one.value
        mass.set("value", number(factor * link.mass))
        inertia = inertial.find("inertia")
        if inertia is not None and _fits_better(max(link.moments), factor, usual):
            _scale(inertia, factor)
    text = f"mass {one.value:.4g} -> {one.usual:.4g} kg"
    draft.change(f"link {one.joint.child!r}", text, "mass of the same part of the other legs")


def _moment(measures: Measures, one: Unlike) -> float:
    """Return the median of the largest moments of inertia of the same part of other legs."""
    for joints in like_joints(measures):
        if one.joint in joints:
            links = [measures.file.link_by_name[j.child] for j in joints if j is not one.joint]
            return median(max(link.moments, default=0.0) for link in links)
    return 0.0


def _fits_better(moment: float, factor: float, usual: float) -> bool:
    """Return whether a moment of inertia is nearer to the usual one with the factor."""
    if not (moment > 0.0 and usual > 0.0):
        return True
    return abs(math.log(factor * moment / usual)) < abs(math.log(moment / usual))


def _scale(element: ET.Element, factor: float) -> None:
    for name, text in element.attrib.items():
        try:
            element.set(name, number(factor * float(text)))
        except ValueError:
            continue


def _odd(joints: list[Joint], kind: str, values: list[float]) -> list[Unlike]:
    """Return the one value that differs much from all others, which agree; mostly nothing.

    Several, fewer than half, where they differ by a unit.
    """
    much = LENGTH_UNLIKE if kind in LENGTHS else MUCH_UNLIKE
    least = 0.0 if kind in WITH_ZERO else math.ulp(0.0)  # what is missing is found elsewhere
    if not all(math.isfinite(value) and value >= least for value in values):
        return []
    middle = median(values)
    if middle <= 0.0:
        return []
    odd = [k for k, value in enumerate(values) if not middle / much < value < middle * much]
    others = [value for k, value in enumerate(values) if k not in odd]
    if len(odd) > 1:  # legs of two kinds may differ, not by a unit
        far = SEVERAL_UNLIKE
        slips = all(not middle / far < values[k] < middle * far for k in odd)
        odd = odd if slips and 2 * len(odd) < len(values) else []
    if not odd or max(others) > much * min(others):
        return []
    return [Unlike(joints[k], kind, values[k], median(others)) for k in odd]


def _lengths(measures: Measures) -> dict[int, float]:
    """Return the distances of joints from the moved joints above [m], by `id`; 0 of the first."""
    found, places = {}, measures.places
    for chain in measures.chains:
        for above, below in zip((None, *chain), chain, strict=False):
            known = above is not None and above.child in places and below.child in places
            ends = (places[x.child][1] for x in (above, below)) if known and above else ()
            found[id(below)] = math.dist(*ends) if known else 0.0
    return found


def _resisting(measures: Measures, joints: Sequence[Joint], kind: str) -> list[Unlike]:
    """Return the one joint that damping or friction holds much more than the others."""
    values = [joint.dynamics(kind) for joint in joints]
    middle, holding = median(values), measures.holding_torque if measures.plausible_mass else 0.0
    speeds = [joint.limit("velocity", rules.SPEED) or rules.SPEED for joint in joints]
    odd = [
        k for k, (value, speed) in enumerate(zip(values, speeds, strict=True))
        if value > MUCH_UNLIKE * middle
        and (value - middle) * (min(speed, rules.SPEED) if kind == "damping" else 1.0)
        > RESISTS * holding > 0.0
    ]  # fmt: skip
    return [Unlike(joints[k], kind, values[k], middle) for k in odd] if len(odd) == 1 else []


def _radius(measures: Measures, joint: Joint) -> float:
    """Return the largest radius of collision spheres of the body that a joint moves [m]."""
    links = measures.file.link_by_name
    names = [name for name in measures.file.rigid_group(joint.child) if name in links]
    spheres = (x for name in names for x in links[name].element.iterfind(SPHERES))
    return max((length(sphere, "radius") for sphere in spheres), default=0.0)


SPHERES = "collision/geometry/sphere"
"""Where a link has those of its foot."""


def _end(measures: Measures, joint: Joint) -> float:
    """Return how far the frames of the body that a joint moves are from it, at most [m].

    NaN where the place of one cannot be read.
    """
    places, file = measures.places, measures.file
    names = [name for name in file.rigid_group(joint.child) if name in places]
    below = [x for name in names for x in file.joints_below.get(name, ())]
    if not all(math.isfinite(x) for one in below for x in (*one.xyz, *one.rpy)):
        return math.nan
    return math.dist(end_of(measures, joint), places[joint.child][1]) if names else 0.0


def _mass(measures: Measures, joint: Joint) -> float:
    """Return the mass of the body that a joint moves [kg]; NaN where one is no number."""
    links = measures.file.link_by_name
    names = [name for name in measures.file.rigid_group(joint.child) if name in links]
    return sum(links[name].mass or 0.0 for name in names)
