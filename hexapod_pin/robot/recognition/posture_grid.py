"""The best posture on a grid of ground heights and leans, for legs with walking joints alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.posture_candidates import all_postures, leg_postures
from hexapod_pin.robot.recognition.posture_coxa import radial_directions
from hexapod_pin.robot.recognition.posture_frame import LegFrame
from hexapod_pin.robot.recognition.posture_score import (
    LegMeasure,
    crossing_legs,
    standing_score,
    walking_bound,
    walking_score,
)

EQUAL_SCORES = 1e-7
"""Scores that differ by less are taken as equal: the first on the grid is chosen."""

MEAN_WEIGHT = 0.01
"""Weight of the legs' mean score beside that of the worst leg."""

CROSSING = 5.0
"""What a pair of legs that cross costs."""

WALKED_AT_ONCE = 24
"""How many postures are looked at in a walk before the best is compared with the rest."""

WALKED_AT_EACH_HEIGHT = 12
"""How many postures of a leg on its own are looked at in a walk, for each height."""

BRANCHES = 4
"""Postures of a leg with one height and one lean."""


@dataclass(frozen=True, eq=False)
class Grid:
    """What is looked at.

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
        grid: what is looked at.
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

    Walks are looked at in the order of what postures are worth at most, until none can be better.
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
