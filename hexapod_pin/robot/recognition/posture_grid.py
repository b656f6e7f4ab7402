"""The best posture on a grid of ground heights and leans, for legs with walking joints alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.posture_candidates import all_postures, leg_postures
from hexapod_pin.robot.recognition.posture_coxa import radial_directions
from hexapod_pin.robot.recognition.posture_frame import LegFrame
from hexapod_pin.robot.recognition.posture_score import (
    LegMeasure,
    crossing_legs,
    standing_score,
    walking_score,
)

EQUAL_SCORES = 1e-7
"""Scores that differ by less are taken as equal: the first on the grid is chosen."""

MEAN_WEIGHT = 0.01
"""Weight of the legs' mean score beside that of the worst leg."""

CROSSING = 5.0
"""What a pair of legs that cross costs."""

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
    scores, angles = [], []
    for k, (leg, out) in enumerate(zip(legs, radial_directions(legs), strict=True)):
        tips = soles + leg.radius
        if grid.leans is None:
            postures = all_postures(leg, out, tips)
        else:
            postures = leg_postures(leg, float(grid.coxa[k]), out, tips, grid.leans[k])
        scores.append(_scores(LegMeasure.of(leg), postures, trunk_low - soles))
        angles.append(postures)
    place = _best_place(scores)
    if place is None:
        return None
    row, columns = place
    chosen = tuple(q[row, column] for q, column in zip(angles, columns, strict=True))
    worst = min(float(score[row, column]) for score, column in zip(scores, columns, strict=True))
    worst -= CROSSING * len(crossing_legs(legs, chosen))
    return Found(worst, chosen, float(soles[row]), _leans(grid, columns))


def _scores(measure: LegMeasure, angles: Array, clearance: Array) -> Array:
    """Return the score of postures (H, C, J), -inf where there is none. Shape (H, C)."""
    score = np.full(angles.shape[:2], -np.inf)
    with np.errstate(invalid="ignore"):
        inside = measure.margin(angles) >= 0.0
    if inside.any():
        q = angles[inside]
        free = np.broadcast_to(clearance[:, None], inside.shape)[inside]
        score[inside] = standing_score(measure, q, free) + walking_score(measure, q)
    return score


def _best_place(scores: list[Array]) -> tuple[int, list[int]] | None:
    """Return the height and each leg's posture: the same for all, else each leg's own best."""
    if len({score.shape for score in scores}) == 1:
        stacked = np.stack(scores)
        if np.isfinite(stacked.min(axis=0)).any():
            row, column = divmod(_first_largest(_together(stacked)), stacked.shape[2])
            return row, [column] * len(scores)
    each = np.stack([score.max(axis=1) for score in scores])
    if not np.isfinite(each.min(axis=0)).any():
        return None
    row = _first_largest(_together(each))
    return row, [_first_largest(score[row]) for score in scores]


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
