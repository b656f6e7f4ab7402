"""The standing posture of a robot: searched over foot heights and inclinations of the tibiae.

Nothing depends on how the robot's file is written (signs and zeros of joints, names, base frame):
the grid is one of heights and inclinations, the postures on it are closed forms of the axes' lines,
and of postures that are equally good the first on the grid is taken.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.robot.recognition.posture_candidates import (
    ALL_HEIGHTS,
    FINER_HEIGHTS,
    FINER_LEANS,
    HEIGHTS,
    LEANS,
    second_axis_height,
)
from hexapod_pin.robot.recognition.posture_coxa import coxa_choices
from hexapod_pin.robot.recognition.posture_frame import LegFrame, StandingPosture, leg_length
from hexapod_pin.robot.recognition.posture_grid import EQUAL_SCORES, Found, Grid, best_on_grid
from hexapod_pin.robot.recognition.posture_held import Places, held_choices, with_held
from hexapod_pin.robot.recognition.posture_kinematics import at_height
from hexapod_pin.robot.recognition.posture_score import LegMeasure
from hexapod_pin.robot.recognition.posture_words import refusal, sentence

GOOD_SCORE = 0.5
"""A posture with this score is taken without a look at other places of the coxae."""


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
        ReachError: there is no such posture; it names the leg, the joint and the way out.
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
