"""The directions, legs, feet and posture of a robot are recognised in its URDF.

Each inference is reported in a sentence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ReachError, UrdfError
from hexapod_pin.robot.description.leg_names import leg_names, leg_of_chain
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile
from hexapod_pin.robot.recognition.chains import check_tree, walking_joints
from hexapod_pin.robot.recognition.directions import (
    Forward,
    Layout,
    find_forward,
    forward_doubt,
    given_forward,
    hip_points,
    is_left,
)
from hexapod_pin.robot.recognition.feet import (
    FoundFoot,
    local,
    off_tip,
    provisional_feet,
    standing_feet,
)
from hexapod_pin.robot.recognition.layout import (
    LegLayout,
    RobotHints,
    RobotLayout,
    free_name,
    known_places,
    known_posture,
    layout_named,
    layout_of_feet,
    layout_stated,
)
from hexapod_pin.robot.recognition.legs import Legs, choose_legs
from hexapod_pin.robot.recognition.posture_frame import LegFrame, with_joint_at
from hexapod_pin.robot.recognition.posture_search import standing_posture
from hexapod_pin.robot.recognition.shape_points import link_points
from hexapod_pin.robot.recognition.sides import EXCHANGED, side_doubt, unlike_sides
from hexapod_pin.robot.recognition.up import Up, find_up

if TYPE_CHECKING:
    from hexapod_pin.robot.reading.resources import ResourceFinder


def recognise(file: UrdfFile, finder: ResourceFinder, hints: RobotHints) -> RobotLayout:
    """Return the robot in a URDF: its forward direction, legs, feet and standing posture.

    A robot that has no legs to walk with but feet that are given has a layout without legs.

    Args:
        file: a URDF, as read; only its tree need be sound.
        finder: of its meshes.
        hints: given by the user; they go before everything inferred.

    Raises:
        UrdfError: no robot of 4 to 8 legs can be found; every finding names the part and a remedy.
        UnknownNameError: a hint names a joint or foot link that does not exist.
        ParameterError: a foot radius out of range.
    """
    check_tree(file)
    stated, held = known_posture(file, hints), known_places(file, hints)
    free = hints.legs is None and hints.forward is None  # what the file states holds
    if free and (own := layout_stated(file, hints)) is not None:
        return own
    legs: Legs | None = None
    try:
        legs = choose_legs(file, finder, hints.legs, held)
        return _recognised(file, finder, hints, legs, stated)
    except UrdfError:
        if not _may_only_stand(file, hints, legs):
            raise
        return layout_named(file, hints) or layout_of_feet(file, hints)


def _may_only_stand(file: UrdfFile, hints: RobotHints, legs: Legs | None) -> bool:
    """Return whether the robot may have feet only: the user gives them, and it is no hexapod."""
    if hints.feet is None or hints.legs is not None or hints.forward is not None:
        return False
    joints = [] if legs is None else [len(chain.joints) for chain in legs.chains]
    return joints != [3] * 6 or sum(joint.moves for joint in file.joints) != 18


def _recognised(
    file: UrdfFile, finder: ResourceFinder, hints: RobotHints, legs: Legs,
    stated: Mapping[str, float],
) -> RobotLayout:  # fmt: skip
    """Return the layout of a robot with these legs."""
    up = find_up(legs.chains, legs.frames, legs.tips, stated, file.base)
    forward, reasons, doubt = _forward(file, legs, up, hints)
    legs, names = _named(legs, forward.turn)
    walking, surplus = walking_joints(legs.chains, legs.frames, legs.tips, up.unit)
    feet = provisional_feet(file, legs, names, hints.feet, hints.foot_radius)
    low = _trunk_low(file, finder, legs, up)
    standing = stand(file, legs, names, feet, walking, forward.turn, stated, low)
    lower = standing_feet(file, legs, names, feet, standing.angles, -up.unit, hints.foot_radius)
    if _moved(feet, lower):
        feet = lower
        standing = stand(file, legs, names, feet, walking, forward.turn, stated, low, standing)
    texts = [*reasons, *([surplus] if surplus else []), *feet_text(file, legs, names, feet)]
    found = _layout(file, legs, names, feet, walking, forward.turn, standing, texts)
    if legs.given is not None or hints.forward is not None:
        return replace(found, caution=doubt)
    caution, doubt = _side_doubts(legs, forward.turn, forward.named)
    return replace(found, caution=caution, doubt=doubt)


def _forward(
    file: UrdfFile, legs: Legs, up: Up, hints: RobotHints
) -> tuple[Forward, list[str], str]:
    """Return the trunk's axes, the reasons, and what speaks against a given direction.

    There is no reason where the joints' names determine them.
    """
    given = legs.given
    names = [chain.names for chain in legs.chains] if given is None else [(name,) for name in given]
    mine = {name for chain in legs.chains for name in chain.names}
    others = [link.name for link in file.links if link.name not in mine and link.name != file.base]
    hips = hip_points(legs.chains, legs.frames, legs.tips, up.unit)
    layout = Layout(file, legs.frames, legs.chains, hips, names, others)
    if hints.forward is not None:
        stated = given_forward(hints.forward, up, file.source)
        doubt = forward_doubt(hints.forward, stated, layout, up)
        return stated, [up.reason] * bool(up.unit[2] < 1), doubt
    forward = find_forward(layout, up)
    joints = [[joint.name for joint in chain.joints] for chain in legs.chains]
    habit = [leg_of_chain((x[0], x[1], x[2])) if len(x) == 3 else None for x in joints]
    off = float(np.abs(forward.turn - np.eye(3)).max())
    if off <= max(1e-6, 2 * (forward.miss + up.scatter)) and None not in habit:
        by_place, names_by_place = _order(legs, np.eye(3))
        if [habit[k] for k in by_place] == list(names_by_place):
            return Forward(np.eye(3), "", 0.0), [], ""
    return forward, [up.reason] * bool(up.unit[2] < 1) + [forward.reason], ""


def _named(legs: Legs, turn: Array) -> tuple[Legs, tuple[str, ...]]:
    """Return the legs, left ones first, front to rear, and their names."""
    order, names = _order(legs, turn)
    if legs.given is not None:
        names = tuple(legs.given[k] for k in order)
    chains = tuple(legs.chains[k] for k in order)
    return replace(legs, chains=chains, bodies=tuple(legs.bodies[k] for k in order)), names


def _order(legs: Legs, turn: Array) -> tuple[list[int], tuple[str, ...]]:
    """Return the places of the legs, left ones first, front to rear, and their usual names."""
    hips = hip_points(legs.chains, legs.frames, legs.tips, turn[:, 2])
    hips = (hips - hips.mean(axis=0)) @ turn  # trunk axes
    left = is_left(hips)
    order = sorted(range(len(hips)), key=lambda k: (not left[k], -hips[k, 0]))
    return order, leg_names(sum(left), len(left) - sum(left))


def _side_doubts(legs: Legs, turn: Array, front_known: bool) -> tuple[str, str]:
    """Return what speaks against legs' names, and what against the sides; mostly nothing."""
    hips = hip_points(legs.chains, legs.frames, legs.tips, turn[:, 2])
    hips = (hips - hips.mean(axis=0)) @ turn
    left = is_left(hips)
    found = side_doubt([chain.names for chain in legs.chains], left, front_known)
    if found == EXCHANGED:
        return "", found
    return found, unlike_sides(hips, left)


def _trunk_low(file: UrdfFile, finder: ResourceFinder, legs: Legs, up: Up) -> float | None:
    """Return the lowest point of the trunk's shapes along up [m]; None where it has none."""
    own = {name for chain in legs.chains for name in chain.names}
    heights = [
        legs.frames.links[link].act(points) @ up.unit
        for link in file.rigid_group(file.base)
        if link not in own and len(points := link_points(file, finder, link))
    ]
    return float(min(h.min() for h in heights)) if heights else None


def _moved(before: Sequence[FoundFoot], after: Sequence[FoundFoot]) -> bool:
    """Return whether a centre moved by more than 1 nm, or a radius changed."""
    return any(
        float(np.abs(a.centre - b.centre).max()) > 1e-9 or a.radius != b.radius
        for a, b in zip(before, after, strict=True)
    )


def _layout(
    file: UrdfFile, legs: Legs, names: Sequence[str], feet: Sequence[FoundFoot],
    walking: Sequence[int], turn: Array, standing: Standing, texts: Sequence[str],
) -> RobotLayout:  # fmt: skip
    """Return legs, posture, held joints and sentences as one record."""
    leg_layouts: list[LegLayout] = []
    posture: dict[str, float] = {}
    held = dict(legs.places)
    taken = set(file.link_by_name)
    for name, chain, foot, angles in zip(names, legs.chains, feet, standing.angles, strict=True):
        by_name = dict(zip((j.name for j in chain.joints), angles.tolist(), strict=True))
        walk = tuple(chain.joints[k].name for k in walking)
        posture |= {joint: by_name[joint] for joint in walk}
        held |= {joint: angle for joint, angle in by_name.items() if joint not in walk}
        others = (
            *(j.name for j in chain.joints if j.name not in walk),
            *(j.name for j in chain.others),
        )
        link = foot.link if foot.own else free_name(f"{name}_foot", taken)
        centre = read_only(local(legs.frames.links[foot.link], foot.centre))
        leg_layouts.append(LegLayout(name, walk, others, foot.link, link, centre, foot.radius))
    if standing.reason:
        texts = [*texts, standing.reason]
    if outside := [
        name for name in held if name not in {j for leg in leg_layouts for j in leg.held}
    ]:
        texts = [*texts, f"held in place, as they are in no leg: {', '.join(outside)}"]
    held, posture = (
        {name: place + 0.0 for name, place in places.items()} for places in (held, posture)
    )
    return RobotLayout(read_only(turn), tuple(leg_layouts), held, posture, tuple(texts))


# The standing posture: from the user or the file, else the result of a search.


@dataclass(frozen=True, eq=False)
class Standing:
    """A standing posture: angles of each leg's joints [rad], shape (k,) each, and a reason."""

    angles: tuple[Array, ...]
    reason: str


def stand(
    file: UrdfFile, legs: Legs, names: Sequence[str], feet: Sequence[FoundFoot],
    walking: Sequence[int], turn: Array, stated: Mapping[str, float], trunk_low: float | None,
    before: Standing | None = None,
) -> Standing:  # fmt: skip
    """Return the angles of all legs: the stated ones where they are complete, else searched ones.

    `before` is the posture found with other feet: joints that do not walk keep their angles.

    Raises:
        UrdfError: a walking joint without a range, or no posture on level feet.
    """
    chains = legs.chains
    walk = [chain.joints[k].name for chain in chains for k in walking]
    if set(walk) <= set(stated):
        return Standing(
            tuple(np.array([_place(legs, stated, j) for j in chain.joints]) for chain in chains), ""
        )
    if findings := [text for chain in chains for j in chain.joints if (text := _no_range(j))]:
        raise UrdfError(file.source, findings)
    frames = [
        _frame(legs, k, name, foot, walking, turn, before)
        for k, (name, foot) in enumerate(zip(names, feet, strict=True))
    ]
    try:
        found = standing_posture(frames, trunk_low=trunk_low)
    except ReachError as error:
        raise UrdfError(file.source, [f"no standing posture: {error}"]) from error
    angles = []
    for k, (chain, searched) in enumerate(zip(chains, found.angles, strict=True)):
        held = _held(legs, k, walking, before)
        left = [q for q in range(len(chain.joints)) if q not in held]
        by_place = held | dict(zip(left, searched.tolist(), strict=True))
        given = [stated.get(joint.name, by_place[q]) for q, joint in enumerate(chain.joints)]
        angles.append(np.array(given, dtype=float))
    return Standing(tuple(angles), found.reason)


def _frame(
    legs: Legs, index: int, name: str, foot: FoundFoot, walking: Sequence[int], turn: Array,
    before: Standing | None,
) -> LegFrame:  # fmt: skip
    """Return a leg in trunk axes, for the search of a posture."""
    joints = legs.chains[index].joints
    axes = [legs.frames.axes[joint.name] for joint in joints]
    limits = np.array([_limits(joint) for joint in joints])
    frame = LegFrame(
        name, np.array([axis.unit for axis in axes]) @ turn,
        np.array([axis.origin for axis in axes]) @ turn, foot.centre @ turn, foot.radius,
        limits[:, 0], limits[:, 1], tuple(walking), tuple(joint.name for joint in joints),
    )  # fmt: skip
    for k, place in sorted(_held(legs, index, walking, before).items(), reverse=True):
        frame = with_joint_at(frame, k, place - legs.places.get(joints[k].name, 0.0))
    return frame


def _held(
    legs: Legs, index: int, walking: Sequence[int], before: Standing | None
) -> dict[int, float]:
    """Return the joints of a leg that the search leaves where they are [rad]."""
    joints = legs.chains[index].joints
    held = {k: legs.places[j.name] for k, j in enumerate(joints) if j.name in legs.places}
    if before is not None:
        held |= {k: float(before.angles[index][k]) for k in range(len(joints)) if k not in walking}
    return held


def _limits(joint: Joint) -> tuple[float, float]:
    """Return the limits of a joint [rad]."""
    if joint.kind == "continuous":
        return -np.inf, np.inf
    return joint.limit("lower", 0.0), joint.limit("upper", 0.0)


def _no_range(joint: Joint) -> str:
    """Return a finding where a joint's limits leave it no range, else ""."""
    lower, upper = joint.limit("lower", 0.0), joint.limit("upper", 0.0)
    if joint.kind == "continuous" or lower < upper:
        return ""
    return (
        f"joint {joint.name!r}: limits {lower:g} to {upper:g} rad leave no range to walk;"
        " correct them, or state how the robot stands with posture=[...]"
    )


def _place(legs: Legs, stated: Mapping[str, float], joint: Joint) -> float:
    """Return the stated angle of a joint, else the place where it is held, else zero [rad]."""
    return float(stated.get(joint.name, legs.places.get(joint.name, 0.0)))


# Sentences on inferred feet: one for the legs that share a rule.


def feet_text(
    file: UrdfFile, legs: Legs, names: Sequence[str], feet: Sequence[FoundFoot]
) -> list[str]:
    """Return sentences on feet: the rules used, frames that are not at the tip, unused shapes."""
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
    owners = {rule: ", ".join(names[k] for k in places) for rule, places in rules.items()}
    return [
        *(
            f"feet of {owners[rule]}: {rule}, on {_listed([feet[k].link for k in places])};"
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
