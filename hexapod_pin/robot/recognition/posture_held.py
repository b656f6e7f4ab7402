"""Where the joints of a leg stand that do not walk: bends of the leg on a stated grid."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.posture_coxa import direction, radial_directions
from hexapod_pin.robot.recognition.posture_frame import (
    LegFrame,
    axis_points,
    leg_length,
    middle_of,
    with_joint_at,
)
from hexapod_pin.robot.recognition.posture_kinematics import within

BENDS = np.radians([0, 15, -15, 30, -30, 45, -45, 60, -60, 75, -75, 90, -90])
"""Angles between the links before and beyond a held joint, downwards first [rad]."""

FEW_BENDS = np.radians([0, 30, -30, 60, -60])
"""The same where a leg has more than one held joint [rad]."""

SHORT_LINK = 0.05
"""A bend has no meaning between links shorter than this share of the leg."""

BEND_COST = 1.0 / np.radians(90.0) ** 2
"""What a bend costs in a posture's score, times its square [1/rad^2] (*assumed*)."""

Places = tuple[tuple[float, ...], ...]
"""Angles of the held joints, leg by leg, from the trunk outwards [rad]."""


class HeldChoice(NamedTuple):
    """Places of the held joints, and what their bends cost in the score."""

    places: Places
    cost: float


def held_choices(legs: Sequence[LegFrame]) -> list[HeldChoice]:
    """Return places of the held joints: the same bends in all legs that have such joints.

    A bend that some leg's limits forbid is left out; where none is left, and for joints that only
    twist the leg, the middle of the limits is taken.
    """
    most = max(len(leg.axes) - len(leg.walking) for leg in legs)
    if most == 0:
        return [HeldChoice(((),) * len(legs), 0.0)]
    outward = radial_directions(legs)
    bends = BENDS if most == 1 else FEW_BENDS
    choices: dict[Places, float] = {}
    for chosen in product(bends, repeat=most):
        places = [_places(leg, out, chosen) for leg, out in zip(legs, outward, strict=True)]
        known = tuple(place for place in places if place is not None)
        if len(known) == len(legs):
            choices.setdefault(known, BEND_COST * float(np.square(chosen).sum()))
    if not choices:
        choices[tuple(tuple(_middle(leg, k) for k in _held(leg)) for leg in legs)] = 0.0
    return [HeldChoice(places, cost) for places, cost in choices.items()]


def with_held(leg: LegFrame, places: Sequence[float]) -> LegFrame:
    """Return the leg with its held joints at angles [rad] and no longer joints."""
    for k, place in sorted(zip(_held(leg), places, strict=True), reverse=True):
        leg = with_joint_at(leg, k, place)
    return leg


def _held(leg: LegFrame) -> list[int]:
    """Return which joints are held."""
    return [k for k in range(len(leg.axes)) if k not in leg.walking]


def _middle(leg: LegFrame, joint: int) -> float:
    """Return the middle of a joint's limits, 0 without any [rad]."""
    return float(middle_of(leg.lower[joint], leg.upper[joint]))


def _places(leg: LegFrame, out: Array, bends: Sequence[float]) -> tuple[float, ...] | None:
    """Return a leg's angles for bends of its held joints, or None where limits forbid them."""
    places = []
    for joint, bend in zip(_held(leg), bends, strict=False):
        straight = _straight(leg, joint)
        if straight is None:
            places.append(_middle(leg, joint))
            continue
        limits = leg.lower[joint : joint + 1], leg.upper[joint : joint + 1]
        angle = within(np.array([straight + _downwards(leg, joint, out) * bend]), *limits)
        if not limits[0] <= angle <= limits[1]:
            return None
        places.append(float(angle[0]))
    return tuple(places)


def _straight(leg: LegFrame, joint: int) -> float | None:
    """Return the angle at which the links before and beyond a joint are in line; None: no such."""
    points = np.vstack([axis_points(leg), leg.tip])
    axis = leg.axes[joint]
    if joint == 0:
        return None
    before, beyond = points[joint] - points[joint - 1], points[joint + 1] - points[joint]
    before, beyond = (link - (link @ axis) * axis for link in (before, beyond))
    if min(np.linalg.norm(before), np.linalg.norm(beyond)) < SHORT_LINK * leg_length(leg):
        return None
    return -float(np.arctan2(np.cross(before, beyond) @ axis, before @ beyond))


def _downwards(leg: LegFrame, joint: int, out: Array) -> float:
    """Return the sign of a joint's turn that lowers the leg beyond it where the leg is level."""
    pitch = leg.axes[leg.walking[1]]
    facing = direction(with_held(leg, [0.0] * len(_held(leg))), 0.0, out)
    lowers = np.sign(np.cross(facing, [0.0, 0.0, -1.0]) @ pitch) or 1.0
    return float(lowers * (np.sign(leg.axes[joint] @ pitch) or 1.0))
