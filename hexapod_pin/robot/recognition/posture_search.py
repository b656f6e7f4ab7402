"""The standing posture is searched on a grid of foot heights, inclinations and leans.

Nothing depends on how the robot's file is written (signs and zeros of joints, names, base frame):
the grid is one of heights and inclinations, the postures on it are closed forms of the axes' lines,
and of postures that are equally good the first on the grid is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.robot.recognition.posture_frame import (
    LegFrame,
    StandingPosture,
    at_height,
    axis_points,
    coxa_choices,
    direction,
    leg_length,
    middle_of,
    radial_directions,
    with_joint_at,
    within,
)
from hexapod_pin.robot.recognition.posture_score import (
    ALL_HEIGHTS,
    FINER_HEIGHTS,
    FINER_LEANS,
    HEIGHTS,
    LEANS,
    LegMeasure,
    all_postures,
    crossing_legs,
    leg_postures,
    refusal,
    second_axis_height,
    sentence,
    standing_score,
    walking_bound,
    walking_score,
)

GOOD_SCORE = 0.5
"""A posture with this score is taken without a search of other places of the coxae."""


def standing_posture(
    legs: Sequence[LegFrame], *, trunk_low: float | None = None
) -> StandingPosture:
    """Return how a robot stands best.

    Feet are level; tibiae are near vertical; joints keep away from their limits and the legs from
    singularity, also in a stroke of a third of the legs' length; the trunk is clear of the ground.

    Args:
        legs: in trunk axes. Two or three walking joints each, the others are held.
        trunk_low: lowest point of the trunk's shapes in trunk axes [m]; None: the second axes.

    Raises:
        ReachError: there is no such posture; it names the leg, the joint and a remedy.
    """
    best: tuple[float, Found, Places] | None = None
    choices = held_choices(legs)
    for places, cost in choices:
        found = _searched(_walking(legs, places), trunk_low)
        if found and (best is None or found.score - cost > best[0] + EQUAL_SCORES):
            best = found.score - cost, found, places
    if best is None:
        raise refusal(_walking(legs, choices[0].places), trunk_low)
    _, found, places = best
    finer = _refined(_walking(legs, places), found, trunk_low)
    return _whole(legs, finer, places)


def _walking(legs: Sequence[LegFrame], places: Places) -> list[LegFrame]:
    """Return the legs with their held joints at their places: walking joints alone."""
    return [with_held(leg, angles) for leg, angles in zip(legs, places, strict=True)]


def _searched(legs: Sequence[LegFrame], trunk_low: float | None) -> Found | None:
    """Return the best posture of legs with walking joints alone, or None."""
    best: Found | None = None
    length = _mean_length(legs)
    choices = coxa_choices(legs)
    leans = np.tile(LEANS, (len(legs), 1))
    for coxa in choices:
        hips = _hips(legs, coxa)
        grid = Grid(coxa, hips.mean() - HEIGHTS * length, leans)
        found = best_on_grid(legs, grid, _lowest(hips, trunk_low))
        if found and (best is None or found.score > best.score + EQUAL_SCORES):
            best = found
        if best and best.score > GOOD_SCORE:
            return best
    if best is None:
        hips = _hips(legs, choices[0])
        grid = Grid(choices[0], hips.mean() - ALL_HEIGHTS * length, None)
        best = best_on_grid(legs, grid, _lowest(hips, trunk_low))
    return best


def _refined(legs: Sequence[LegFrame], found: Found, trunk_low: float | None) -> Found:
    """Return the best posture of a finer grid around one that was found."""
    coxa = np.array([q[0] for q in found.angles])
    soles = found.sole - FINER_HEIGHTS * _mean_length(legs)
    leans = np.abs(found.leans[:, None] + FINER_LEANS)
    finer = best_on_grid(legs, Grid(coxa, soles, leans), _lowest(_hips(legs, coxa), trunk_low))
    return finer if finer and finer.score > found.score + EQUAL_SCORES else found


def _hips(legs: Sequence[LegFrame], coxa: Array) -> Array:
    """Return the heights of the second axes in trunk axes [m]. Shape (L,)."""
    return np.array([second_axis_height(*row) for row in zip(legs, coxa, strict=True)])


def _lowest(hips: Array, trunk_low: float | None) -> float:
    """Return the lowest point of the trunk in trunk axes [m]."""
    return float(hips.min()) if trunk_low is None else trunk_low


def _mean_length(legs: Sequence[LegFrame]) -> float:
    """Return the mean length of the legs beyond their first links [m]."""
    return float(np.mean([leg_length(leg) for leg in legs]))


def _whole(legs: Sequence[LegFrame], found: Found, places: Places) -> StandingPosture:
    """Return the posture of the whole legs, feet level to rounding."""
    angles = []
    for leg, walking, held in zip(legs, found.angles, places, strict=True):
        frame = with_held(leg, held)
        free = [k for k in range(1, len(walking)) if frame.upper[k] > frame.lower[k]]
        q = at_height(LegMeasure.of(frame).foot, walking, free, found.sole + leg.radius)
        whole = np.empty(len(leg.axes))
        whole[list(leg.walking)] = q
        whole[[k for k in range(len(leg.axes)) if k not in leg.walking]] = held
        angles.append(read_only(whole))
    return StandingPosture(tuple(angles), -found.sole, sentence(legs, angles, found.sole))


# The best posture on a grid of ground heights and leans, for legs with walking joints alone.

EQUAL_SCORES = 1e-7
"""Scores that differ by less are taken as equal: the first on the grid is chosen."""

MEAN_WEIGHT = 0.01
"""Weight of the legs' mean score beside that of the worst leg."""

CROSSING = 5.0
"""Cost of a pair of legs that cross."""

WALKED_AT_ONCE = 24
"""Postures scored in a walk before the best is compared with the rest."""

WALKED_AT_EACH_HEIGHT = 12
"""Postures of one leg scored in a walk, for each height."""

BRANCHES = 4
"""Postures of a leg with one height and one lean."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Postures to compare.

    Attributes:
        coxa: angles of the legs' first joints [rad]. Shape (L,).
        soles: heights of the ground in trunk axes [m]. Shape (H,).
        leans: of each leg's last link [rad], (L, T); None: all angles of all joints.
    """

    coxa: Array
    soles: Array
    leans: Array | None


@dataclass(frozen=True, eq=False)
class Found:
    """The best posture of a grid.

    Attributes:
        score: of the worst leg, legs that cross counted.
        angles: of the walking joints, leg by leg [rad].
        sole: height of the ground in trunk axes [m].
        leans: of each leg's last link, where the grid was one of leans [rad]. Shape (L,).
    """

    score: float
    angles: tuple[Array, ...]
    sole: float
    leans: Array


def best_on_grid(legs: Sequence[LegFrame], grid: Grid, trunk_low: float) -> Found | None:
    """Return the best posture of a grid, the trunk clear of the ground; None where there is none.

    Args:
        legs: with walking joints alone.
        grid: the postures to compare.
        trunk_low: lowest point of the trunk in trunk axes [m].
    """
    soles = grid.soles[grid.soles < trunk_low]
    if not soles.size:
        return None
    measures, postures, bounds = [], [], []
    for k, (leg, out) in enumerate(zip(legs, radial_directions(legs), strict=True)):
        tips = soles + leg.radius
        if grid.leans is None:
            angles = all_postures(leg, out, tips)
        else:
            angles = leg_postures(leg, float(grid.coxa[k]), out, tips, grid.leans[k])
        measure = LegMeasure.of(leg)
        bounds.append(_bounds(measure, angles, trunk_low - soles))
        measures.append(measure)
        postures.append(angles)
    found = None if grid.leans is None else _best_shared(measures, postures, bounds)
    found = found or _best_each(measures, postures, bounds)
    if found is None:
        return None
    score, row, columns = found
    chosen = tuple(q[row, column] for q, column in zip(postures, columns, strict=True))
    score -= CROSSING * len(crossing_legs(legs, chosen))
    return Found(score, chosen, float(soles[row]), _leans(grid, columns))


class Bounds(NamedTuple):
    """Scores of postures (H, C) of a leg, -inf where there is none: standing, and at most."""

    standing: Array
    most: Array


Place = tuple[float, int, list[int]]
"""The score of all legs, the height's row and each leg's column."""


def _bounds(measure: LegMeasure, angles: Array, clearance: Array) -> Bounds:
    """Return the scores of postures (H, C, J) as far as they are known without a walk."""
    standing, most = np.full((2, *angles.shape[:2]), -np.inf)
    with np.errstate(invalid="ignore"):
        inside = measure.margin(angles) >= 0.0
    if inside.any():
        q = angles[inside]
        free = np.broadcast_to(clearance[:, None], inside.shape)[inside]
        standing[inside] = standing_score(measure, q, free)
        most[inside] = standing[inside] + walking_bound(measure, q)
    return Bounds(standing, most)


def _best_shared(
    measures: list[LegMeasure], postures: list[Array], bounds: list[Bounds]
) -> Place | None:
    """Return the best posture that is the same on the grid for all legs, or None.

    Walks are scored in the order of the postures' upper bounds, until none can be better.
    """
    if len({angles.shape for angles in postures}) > 1:
        return None
    most = _together(np.stack([bound.most for bound in bounds]))
    count = int(np.isfinite(most).sum())
    order = np.argsort(-most, axis=None, kind="stable")[:count]
    stacked = LegMeasure.stack(measures)
    exact = np.full(most.shape, -np.inf)
    for begin in range(0, count, WALKED_AT_ONCE):
        rows, columns = np.unravel_index(order[begin : begin + WALKED_AT_ONCE], most.shape)
        q = np.stack([angles[rows, columns] for angles in postures])
        standing = np.stack([bound.standing[rows, columns] for bound in bounds])
        exact[rows, columns] = _together(standing + walking_score(stacked, q))
        left = most.ravel()[order[begin + WALKED_AT_ONCE :]]
        if not left.size or left[0] < exact.max() - 2.0 * EQUAL_SCORES:
            break
    if not count:
        return None
    row, column = divmod(_first_largest(exact), most.shape[1])
    return float(exact[row, column]), row, [column] * len(measures)


def _best_each(
    measures: list[LegMeasure], postures: list[Array], bounds: list[Bounds]
) -> Place | None:
    """Return the best height with each leg's own best posture, or None."""
    scores = []
    for measure, angles, bound in zip(measures, postures, bounds, strict=True):
        score = np.full(bound.standing.shape, -np.inf)
        promising = np.argsort(-bound.most, axis=1, kind="stable")[:, :WALKED_AT_EACH_HEIGHT]
        rows = np.repeat(np.arange(len(score)), promising.shape[1])
        known = np.isfinite(bound.standing[rows, promising.ravel()])
        place = rows[known], promising.ravel()[known]
        if known.any():
            score[place] = bound.standing[place] + walking_score(measure, angles[place])
        scores.append(score)
    best = np.stack([score.max(axis=1) for score in scores])
    total = _together(best)
    if not np.isfinite(total).any():
        return None
    row = _first_largest(total)
    return float(total[row]), row, [_first_largest(score[row]) for score in scores]


def _together(score: Array) -> Array:
    """Return the score of all legs (L, ...): that of the worst, and a little of the mean."""
    together: Array = score.min(axis=0) + MEAN_WEIGHT * score.mean(axis=0)
    return together


def _first_largest(score: Array) -> int:
    """Return the first of the largest scores, rounding aside."""
    return int(np.argmax(score.ravel() >= score.max() - EQUAL_SCORES))


def _leans(grid: Grid, columns: list[int]) -> Array:
    """Return the lean of each leg's chosen posture [rad]. Shape (L,)."""
    if grid.leans is None:
        return np.zeros(len(columns))
    count = grid.leans.shape[1]
    return np.array(
        [row[min(k // BRANCHES, count - 1)] for row, k in zip(grid.leans, columns, strict=True)]
    )


# Angles of the held joints of a leg: bends of the leg on a grid.

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
