"""A walk is checked as a whole: start, steady cycles and stop, every foot target on a fine grid.

The first violation is reported.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.body_path import TRANSIENT_CYCLES
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.leg_group import LegGroup
from hexapod_pin.errors import GaitError, ReachError
from hexapod_pin.robot.leg_kinematics import LegKinematics

if TYPE_CHECKING:
    from hexapod_pin.control.body_motion import BodyMotion


CHECKED_CYCLES = 7
"""Length of the checked walk [cycles]: 2 to start, 2.25 or more steady, the rest to stop."""

SAMPLES_PER_CYCLE = 300

KEPT_PATHS = 64
"""How many checked walks are cached, whatever the cycle time (0.5 MB each)."""

MIN_NORMALISED_DETERMINANT = 0.02
"""Smallest normalised Jacobian determinant a plan may pass (*assumed*).

|det J| over the product of the column lengths: with a knee bent by a small angle e it is about
e L2 / (L2 + L3), so this keeps the knee some 2 degrees from straight.
"""

MAX_FOOT_HEIGHT_SPREAD = 1e-3
"""The standing feet may differ in height by this much [m], *assumed*."""

EQUAL_RATES = 1e-9
"""Relative difference of the largest rates of two legs that is taken for rounding."""

SINGULAR = {
    2: "neither joint moves the foot along the direction of travel or both move it equally",
    3: "knee straight or foot under the yaw axis",
}
"""Singular postures of legs, by the number of their joints."""

PATH, RATE, POSTURE = "path", "rate", "posture"


@dataclass(frozen=True)
class Violation:
    """The first reason why a gait cannot be walked.

    Attributes:
        kind: PATH (reach, singularity, joint position), RATE (joint velocity) or POSTURE (the
            robot does not stand on level feet).
        text: names the leg, the joint, the value and the limit.
        brief: the reason in a few words.
    """

    kind: str
    text: str
    brief: str = ""


def violation(six: LegGroup, gait: Gait, motion: BodyMotion | None = None) -> Violation | None:
    """Return why the robot cannot walk this gait, or None if it can.

    Args:
        six: its legs.
        gait: the gait.
        motion: constant offsets of the trunk; None: none.

    Raises:
        GaitError: the gait has phases for other legs.
    """
    six, gait = six.along(gait), six.fitted(gait)
    if np.ptp(six.soles) > MAX_FOOT_HEIGHT_SPREAD:
        return _uneven(six)
    found = checked_walk(six, gait.in_one_second(), motion)
    if isinstance(found, Violation):
        return found
    fast = _too_fast(six, found.v / gait.cycle_time)
    return None if fast is None else fast[0]


def shortest_cycle(six: LegGroup, gait: Gait) -> float | None:
    """Return the cycle time at which the fastest joint of a gait turns at its velocity limit [s].

    Its paths are those of the gait's own cycle time, on which they depend where it turns. None
    where the robot cannot walk these paths at any rate.

    Raises:
        GaitError: the gait has phases for other legs.
    """
    six, gait = six.along(gait), six.fitted(gait)
    found = checked_walk(six, gait.in_one_second(), None)
    if isinstance(found, Violation):
        return None
    return float((np.abs(found.v) / six.max_rate[:, None]).max())


@dataclass(frozen=True, eq=False)
class CheckedWalk:
    """The joints of a whole walk that nothing speaks against, at the times of `checked_times`.

    Attributes:
        time: [s]. Shape (K,).
        q: joint angles leg by leg [rad]. Shape (L, K, J).
        v: joint rates, to a few digits [rad/s]. Shape (L, K, J).
    """

    time: Array
    q: Array
    v: Array


@lru_cache(maxsize=KEPT_PATHS)
def checked_walk(six: LegGroup, gait: Gait, motion: BodyMotion | None) -> Violation | CheckedWalk:
    """Return what is wrong with the paths of a gait, or how its joints move.

    Args:
        six: the legs, along the gait.
        gait: the gait, in one second: its paths are those of any cycle time.
        motion: constant offsets of the trunk; None: none.
    """
    if six.kinematics.task is not None:
        stands = _singular(six, six.kinematics.posture[:, None], len(six.legs))
        if stands is not None:
            return stands[0]
    path = checked_path(six, gait, motion)
    time = checked_times(path)
    try:
        p_BF, v_BF = six.foot_motion(path, time)
    except ReachError as error:
        return Violation(PATH, str(error), error.brief)
    q, refused = six.kinematics.solve(p_BF)
    if refused is not None:
        found = _singular(six, q, refused[0])
        if found is not None:
            return found[0]
        return Violation(PATH, str(refused[1]), refused[1].brief)
    found = _singular(six, q, len(six.legs))
    if found is not None:
        return found[0]
    return CheckedWalk(time, q, six.kinematics.estimated_rates(p_BF, v_BF, q))


@lru_cache(maxsize=KEPT_PATHS)
def checked_path(six: LegGroup, gait: Gait, motion: BodyMotion | None) -> FootPath:
    """Return the path of a walk of `CHECKED_CYCLES`; all checks share the roll of its feet."""
    stop = CHECKED_CYCLES * gait.cycle_time
    return FootPath.of(six, gait, stop_at=stop, motion=motion).solved_until(stop)


def posture_violation(six: LegGroup, q: Array, v: Array) -> tuple[Violation, int] | None:
    """Return a near singular posture or a joint that is too fast, and at which time.

    Args:
        six: the legs.
        q: joint angles leg by leg [rad]. Shape (L, K, J).
        v: joint rates [rad/s]. Shape (L, K, J).

    Returns:
        The violation and its row among the K; None without one.
    """
    return _singular(six, q, len(six.legs)) or _too_fast(six, v)


def _singular(six: LegGroup, q: Array, legs: int) -> tuple[Violation, int] | None:
    """Return the violation of the first of some legs that gets too near a singular posture."""
    determinant = six.kinematics.normalised_determinant(q)
    for leg, values in zip(six.legs[:legs], determinant, strict=False):
        row = int(np.argmin(values))
        if values[row] < MIN_NORMALISED_DETERMINANT:
            return _near_singular(leg, float(values[row])), row
    return None


def checked_times(path: FootPath) -> Array:
    """Return the times at which a walk of CHECKED_CYCLES is checked [s].

    Of its steady part the first cycle is enough.
    """
    cycles = np.linspace(0.0, CHECKED_CYCLES, CHECKED_CYCLES * SAMPLES_PER_CYCLE + 1)
    time = cycles * path.gait.cycle_time
    return time[(cycles <= TRANSIENT_CYCLES + 1) | (time >= path.steady_until)]


def _uneven(six: LegGroup) -> Violation:
    """Return the violation of a robot whose feet do not stand on one level."""
    low, high = (six.legs[int(k)].name for k in (np.argmin(six.soles), np.argmax(six.soles)))
    return Violation(
        POSTURE,
        f"the standing posture has foot {high} {np.ptp(six.soles):.4f} m above foot {low}; "
        "all must stand on the same ground",
        f"feet {low} and {high} stand on different levels",
    )


def _near_singular(leg: LegKinematics, lowest: float) -> Violation:
    """Return the violation of a leg whose normalised determinant gets too low."""
    return Violation(
        PATH,
        f"leg {leg.name}: the foot path comes too near a singular posture of "
        f"{', '.join(leg.joints)}, {SINGULAR[len(leg.joints)]} "
        f"(normalised determinant {lowest:.4f}, at least {MIN_NORMALISED_DETERMINANT:g})",
        f"leg {leg.name} is stretched or folded",
    )


def _too_fast(six: LegGroup, rates: Array) -> tuple[Violation, int] | None:
    """Return the violation of the joint that exceeds its velocity limit most, rates (L, K, J).

    Of legs that move equally, up to rounding, the first in gait order is named.
    """
    share = np.abs(rates) / six.max_rate[:, None]
    peak = share.max(axis=(1, 2))
    if peak.max() <= 1.0:
        return None
    index = int(np.argmax(peak >= peak.max() * (1.0 - EQUAL_RATES)))
    row, joint = np.unravel_index(int(np.argmax(share[index])), share[index].shape)
    leg, limit = six.legs[index], six.max_rate[index, joint]
    text = (
        f"leg {leg.name}: joint {leg.joints[joint]} would turn at "
        f"{abs(rates[index, row, joint]):.4g} rad/s; its limit is {limit:.4g} rad/s"
    )
    brief = f"{leg.joints[joint]} is at its velocity limit"
    return Violation(RATE, text, brief), int(row)


# The refusal of a walk that does not repeat: what fails first, and when.

SEARCH_STEP = 0.02
"""Spacing of the times of the search for a target out of reach [s]."""


def walk_refusal(six: LegGroup, path: FootPath, end: float, error: ReachError) -> GaitError:
    """Return the error of a walk in which a leg cannot follow, with the time.

    Args:
        six: the legs.
        path: what their feet follow.
        end: duration of the walk [s].
        error: of the leg.
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
    return GaitError(
        f"gait {path.gait.name}: {when}{_conditions(path)}{error}", _culprit(path), None
    )


def refuse_impossible_knots(six: LegGroup, path: FootPath, time: Array, q: Array, v: Array) -> None:
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
        f"gait {path.gait.name}: at t = {time[row]:.3g} s {_conditions(path)}{violation.text}",
        quantity,
        None,
    )


def _conditions(path: FootPath) -> str:
    """Return the text of what is commanded beside the gait."""
    given = [("the trunk's motion", path.motion), ("the velocity command", path.command)]
    names = [name for name, value in given if value is not None]
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
