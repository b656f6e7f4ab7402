"""The postures of one leg that are looked at: foot heights and inclinations on a stated grid."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.posture_coxa import direction
from hexapod_pin.robot.recognition.posture_frame import LegFrame, axis_points, with_joint_at
from hexapod_pin.robot.recognition.posture_kinematics import (
    leaning_postures,
    single_link_postures,
    within,
)

HEIGHTS = np.arange(2, 21) / 20.0
"""Heights of the second axes above the soles, in mean lengths beyond the coxa."""

LEANS = np.radians([0, 5, 10, 15, 20, 30, 40, 50, 60, 70, 80])
"""Inclinations of the last link from its steepest [rad]."""

FINER_HEIGHTS = np.arange(-4, 5) / 100.0
FINER_LEANS = np.radians(np.arange(-4, 5))
"""Steps around the best of these that are looked at in turn."""

ALL_HEIGHTS = np.arange(-8, 49) / 40.0
"""Heights looked at where the grid above has no posture."""

SHARES = np.array([8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15, 0, 16]) / 16.0
"""Places in a joint's range looked at where the grid above has no posture, middle first."""

COXA_SHARES = np.array([4, 3, 5, 2, 6, 1, 7]) / 8.0
"""The same for the first joint."""

UPRIGHT = 0.95
"""A joint whose axis is steeper than this cannot set a foot's height [sine]."""


def leg_postures(
    leg: LegFrame, coxa: float, outward: Array, tip_height: Array, leans: Array = LEANS
) -> Array:
    """Return the postures on the grid, the first joint at an angle.

    Args:
        leg: with walking joints alone.
        coxa: angle of the first joint [rad].
        outward: from the trunk to this leg. Shape (3,).
        tip_height: heights of the foot's centre in trunk axes [m]. Shape (H,).
        leans: inclinations of the last link from its steepest [rad].

    Returns:
        Joint angles [rad], C postures per height; NaN where there is none. Shape (H, C, J).
    """
    facing = direction(leg, coxa, outward)
    rest, fixed = _without_fixed(leg, {0: coxa})
    if not len(rest.axes):
        return np.full((len(tip_height), 1, len(leg.axes)), np.nan)
    if len(rest.axes) == 2:
        found = leaning_postures(rest, facing, tip_height, leans)
    else:
        found = single_link_postures(rest, facing, tip_height)
    return _assembled(leg, fixed, found.reshape(len(tip_height), -1, len(rest.axes)))


def all_postures(leg: LegFrame, outward: Array, tip_height: Array) -> Array:
    """Return postures with all joints but one at shares of their ranges; arguments as above."""
    free = [k for k in range(len(leg.axes)) if _range(leg, k) > 0.0]
    found = []
    for solved in [k for k in free if k > 0]:
        others = [k for k in free if k != solved]
        grids = np.meshgrid(*[_places(leg, k) for k in others], indexing="ij")
        for places in np.stack([grid.ravel() for grid in grids], axis=-1) if others else [()]:
            rest, fixed = _without_fixed(leg, dict(zip(others, places, strict=True)))
            if len(rest.axes) == 1:
                angles = single_link_postures(rest, outward, tip_height)
                found.append(_assembled(leg, fixed, angles.reshape(len(tip_height), 2, 1)))
    if not found:
        return np.full((len(tip_height), 1, len(leg.axes)), np.nan)
    return np.concatenate(found, axis=1)


def second_axis_height(leg: LegFrame, coxa: float) -> float:
    """Return the height of the second axis' point in trunk axes, the first joint at an angle."""
    return float(axis_points(with_joint_at(leg, 0, coxa))[0][2])


def _without_fixed(leg: LegFrame, at: dict[int, float]) -> tuple[LegFrame, dict[int, float]]:
    """Return the leg with some joints at angles, and those that cannot move, and all of these."""
    fixed = {k: leg.lower[k] for k in range(len(leg.axes)) if _range(leg, k) <= 0.0} | at
    for k in sorted(fixed, reverse=True):
        leg = with_joint_at(leg, k, fixed[k])
    return leg, fixed


def _assembled(leg: LegFrame, fixed: dict[int, float], found: Array) -> Array:
    """Return angles of all joints from those of the joints that were free (H, C, free)."""
    free = [k for k in range(len(leg.axes)) if k not in fixed]
    angles = np.empty((*found.shape[:2], len(leg.axes)))
    angles[..., free] = within(found, leg.lower[free], leg.upper[free])
    for k, value in fixed.items():
        angles[..., k] = np.where(np.isnan(found).any(axis=-1), np.nan, value)
    return angles


def _range(leg: LegFrame, joint: int) -> float:
    """Return the width of a joint's limits [rad]."""
    return float(leg.upper[joint] - leg.lower[joint])


def _places(leg: LegFrame, joint: int) -> Array:
    """Return angles over a joint's range; over a turn where it has no limits [rad]."""
    lower, upper = leg.lower[joint], leg.upper[joint]
    if not np.isfinite(upper - lower):
        lower, upper = -np.pi, np.pi
    shares = SHARES if joint else COXA_SHARES
    return np.asarray(lower + shares * (upper - lower))
