"""Finding the robot in a URDF: directions, legs, feet, posture, each inference in a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import UnknownNameError, UrdfError
from hexapod_pin.robot.description.leg_names import leg_names, leg_of_chain
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile
from hexapod_pin.robot.loading.provenance import read_provenance
from hexapod_pin.robot.loading.stated_legs import stated_places
from hexapod_pin.robot.recognition.directions import (
    Forward,
    Layout,
    find_forward,
    given_forward,
    hip_points,
)
from hexapod_pin.robot.recognition.feet import FoundFoot, local
from hexapod_pin.robot.recognition.foot_choice import provisional_feet, standing_feet
from hexapod_pin.robot.recognition.foot_words import feet_text
from hexapod_pin.robot.recognition.hints import RobotHints
from hexapod_pin.robot.recognition.layout import LegLayout, RobotLayout
from hexapod_pin.robot.recognition.layout_symmetry import is_left
from hexapod_pin.robot.recognition.leg_choice import Legs, choose_legs
from hexapod_pin.robot.recognition.posture_choice import Standing, stand, stated_posture
from hexapod_pin.robot.recognition.shape_points import link_points
from hexapod_pin.robot.recognition.stated_layout import stated_layout
from hexapod_pin.robot.recognition.tree_frames import check_tree
from hexapod_pin.robot.recognition.up import Up, find_up
from hexapod_pin.robot.recognition.walking_joints import walking_joints

if TYPE_CHECKING:
    from hexapod_pin.robot.reading.resources import ResourceFinder


def recognise(file: UrdfFile, finder: ResourceFinder, hints: RobotHints) -> RobotLayout:
    """Return the robot in a URDF: which way is forward, its legs and feet, how it stands.

    A robot that has no legs to walk with but feet that are given has a layout without legs.

    Args:
        file: a URDF, as read; only its tree need be sound.
        finder: of its meshes.
        hints: what the user says: it goes before everything inferred.

    Raises:
        UrdfError: no robot of 4 to 8 legs can be found; every finding names part and way out.
        UnknownNameError: a hint names a joint or foot link that does not exist.
        ParameterError: a foot radius out of range.
    """
    check_tree(file)
    own = read_provenance(file).posture
    stated = stated_posture(file, own, hints.posture)
    held = stated_places(file) | _checked_held(file, hints.held or {})
    if (said := stated_layout(file, hints, stated, held)) is not None:
        return said
    legs: Legs | None = None
    try:
        legs = choose_legs(file, finder, hints.legs, held)
        return _recognised(file, finder, hints, legs, stated)
    except UrdfError:
        if not _may_only_stand(file, hints, legs):
            raise
        return RobotLayout(read_only(np.eye(3)), (), posture=stated)


def _may_only_stand(file: UrdfFile, hints: RobotHints, legs: Legs | None) -> bool:
    """Return whether given feet may be all there is: of no hexapod, and not told to walk."""
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
    forward, says = _forward(file, legs, up, hints)
    legs, names = _named(legs, forward.turn)
    walking, surplus = walking_joints(legs.chains, legs.frames, legs.tips, up.unit)
    feet = provisional_feet(file, legs, names, hints.feet, hints.foot_radius)
    low = _trunk_low(file, finder, legs, up)
    standing = stand(file, legs, names, feet, walking, forward.turn, stated, low)
    lower = standing_feet(file, legs, names, feet, standing.angles, -up.unit, hints.foot_radius)
    if _moved(feet, lower):
        feet = lower
        standing = stand(file, legs, names, feet, walking, forward.turn, stated, low, standing)
    texts = [*says, *([surplus] if surplus else []), *feet_text(file, legs, names, feet)]
    return _layout(file, legs, names, feet, walking, forward.turn, standing, texts)


def _forward(file: UrdfFile, legs: Legs, up: Up, hints: RobotHints) -> tuple[Forward, list[str]]:
    """Return the trunk's axes, and what is said of them: nothing where the file's names say it."""
    given = legs.given
    names = [chain.names for chain in legs.chains] if given is None else [(name,) for name in given]
    mine = {name for chain in legs.chains for name in chain.names}
    others = [link.name for link in file.links if link.name not in mine and link.name != file.base]
    hips = hip_points(legs.chains, legs.frames, legs.tips, up.unit)
    layout = Layout(file, legs.frames, legs.chains, hips, names, others)
    if hints.forward is not None:
        return given_forward(hints.forward, up, file.source), [up.reason] * bool(up.unit[2] < 1)
    forward = find_forward(layout, up)
    habit = [_habit_name(chain.joints) for chain in legs.chains]
    off = float(np.abs(forward.turn - np.eye(3)).max())
    if off <= max(1e-6, 2 * (forward.miss + up.scatter)) and None not in habit:
        by_place = _order(legs, np.eye(3))
        if [habit[k] for k in by_place] == list(leg_names(*_sides(legs, np.eye(3)))):
            return Forward(np.eye(3), "", 0.0), []
    return forward, [up.reason] * bool(up.unit[2] < 1) + [forward.reason]


def _habit_name(joints: Sequence[Joint]) -> str | None:
    """Return the leg that the names of three joints tell by an old habit."""
    names = [joint.name for joint in joints]
    return leg_of_chain((names[0], names[1], names[2])) if len(names) == 3 else None


def _named(legs: Legs, turn: Array) -> tuple[Legs, tuple[str, ...]]:
    """Return the legs left ones first, front to rear, and their names."""
    order = _order(legs, turn)
    names = leg_names(*_sides(legs, turn))
    if legs.given is not None:
        names = tuple(legs.given[k] for k in order)
    chains = tuple(legs.chains[k] for k in order)
    return replace(legs, chains=chains, bodies=tuple(legs.bodies[k] for k in order)), names


def _order(legs: Legs, turn: Array) -> list[int]:
    """Return the places of the legs: left ones first, front to rear."""
    hips = _hips(legs, turn)
    left = is_left(hips)
    return sorted(range(len(hips)), key=lambda k: (not left[k], -hips[k, 0]))


def _sides(legs: Legs, turn: Array) -> tuple[int, int]:
    """Return how many legs are on the left and on the right."""
    left = sum(is_left(_hips(legs, turn)))
    return left, len(legs.chains) - left


def _hips(legs: Legs, turn: Array) -> Array:
    """Return the hips about their middle in trunk axes [m]. Shape (L, 3)."""
    hips = hip_points(legs.chains, legs.frames, legs.tips, turn[:, 2])
    centred: Array = (hips - hips.mean(axis=0)) @ turn
    return centred


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
    """Tell whether feet are elsewhere than before."""
    return any(
        float(np.abs(a.centre - b.centre).max()) > 1e-9 or a.radius != b.radius
        for a, b in zip(before, after, strict=True)
    )


def _checked_held(file: UrdfFile, held: Mapping[str, float]) -> dict[str, float]:
    """Return the places that the user gives, of joints that exist."""
    moved = [joint.name for joint in file.joints if joint.moves]
    for name in held:
        if name not in moved:
            raise UnknownNameError("moved joint", name, moved)
    return {name: float(place) for name, place in held.items()}


def _layout(
    file: UrdfFile, legs: Legs, names: Sequence[str], feet: Sequence[FoundFoot],
    walking: Sequence[int], turn: Array, standing: Standing, texts: Sequence[str],
) -> RobotLayout:  # fmt: skip
    """Return what was found as data."""
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
        link = foot.link if foot.own else _new_name(f"{name}_foot", taken)
        centre = read_only(local(legs.frames.links[foot.link], foot.centre))
        leg_layouts.append(LegLayout(name, walk, others, foot.link, link, centre, foot.radius))
    if standing.reason:
        texts = [*texts, standing.reason]
    if outside := [
        name for name in held if name not in {j for leg in leg_layouts for j in leg.held}
    ]:
        texts = [*texts, f"held in place, as they are in no leg: {', '.join(outside)}"]
    return RobotLayout(read_only(turn), tuple(leg_layouts), held, posture, tuple(texts))


def _new_name(name: str, taken: set[str]) -> str:
    """Return a link name that the file does not have, and take it."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name
