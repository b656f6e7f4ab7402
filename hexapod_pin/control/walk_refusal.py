"""The refusal of a walk that does not repeat: what fails first, and when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.feasibility import RATE, posture_violation
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.six_legs import SixLegs
from hexapod_pin.errors import GaitError, ReachError
from hexapod_pin.robot.leg_kinematics import LegKinematics

SEARCH_STEP = 0.02
"""Spacing of the times at which a target out of reach is looked for [s]."""


def walk_refusal(six: SixLegs, path: FootPath, end: float, error: ReachError) -> GaitError:
    """Return the error of a walk in which a leg cannot follow, with the time.

    Args:
        six: the legs.
        path: what their feet follow.
        end: duration of the walk [s].
        error: what the leg says.
    """
    names = [leg.name for leg in six.legs]
    leg = names.index(error.leg)
    time = np.append(np.arange(0.0, end, SEARCH_STEP), end)
    try:
        p_BF = path.positions(time)
    except ReachError:  # the roll of the feet has no solution: take them for points
        p_BF = replace(path, legs=None).positions(time)
    row = _first_out_of_reach(six.legs[leg], p_BF[:, leg])
    when = "" if row is None else f"at t = {time[row]:.3g} s "
    return GaitError(f"gait {path.gait.name}: {when}{_asked(path)}{error}", _culprit(path), None)


def refuse_impossible_knots(six: SixLegs, path: FootPath, time: Array, q: Array, v: Array) -> None:
    """Refuse a planned walk that comes near a singular posture or turns a joint too fast.

    Args:
        six: the legs.
        path: what their feet follow.
        time: of the knots [s]. Shape (K,).
        q: joint angles, `Robot.joint_names` order [rad]. Shape (K, n).
        v: joint rates [rad/s]. Shape (K, n).

    Raises:
        GaitError: naming leg, joint, time, value and limit.
    """
    by_leg = (np.moveaxis(rows[:, six.joint_index], 0, 1) for rows in (q, v))
    found = posture_violation(six, *by_leg)
    if found is None:
        return
    violation, row = found
    quantity = "cycle_time" if violation.kind == RATE else _culprit(path)
    raise GaitError(
        f"gait {path.gait.name}: at t = {time[row]:.3g} s {_asked(path)}{violation.text}",
        quantity,
        None,
    )


def _asked(path: FootPath) -> str:
    """Say what is asked for beside the gait."""
    asked = [("the trunk's motion", path.motion), ("the velocity command", path.command)]
    names = [name for name, value in asked if value is not None]
    return f"with {' and '.join(names)}: " if names else ""


def _culprit(path: FootPath) -> str:
    """Return the name of what to change."""
    return "velocity" if path.command is not None else "body"


def _first_out_of_reach(leg: LegKinematics, p_BF: Array) -> int | None:
    """Return the first target (K, 3) that a leg cannot reach inside its limits; None if all."""
    for row, target in enumerate(p_BF):
        try:
            leg.inverse(target)
        except ReachError:
            return row
    return None
