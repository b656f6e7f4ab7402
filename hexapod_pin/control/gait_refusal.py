"""The refusal of a gait: what to change in the request, and how far."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING

from hexapod_pin.control.feasibility import POSTURE, RATE, Violation, violation
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.leg_clearance import collision
from hexapod_pin.control.six_legs import SixLegs, six_legs
from hexapod_pin.errors import GaitError, ReachError
from hexapod_pin.robot.leg_bodies import LegBodies, leg_bodies

if TYPE_CHECKING:
    from hexapod_pin.control.body_motion import BodyMotion
    from hexapod_pin.control.velocity_command import VelocityCommand
    from hexapod_pin.robot.robot import Robot

NEGLIGIBLE_STROKE = 1e-6
"""A stroke that tests the lift alone [m]: feet that do not travel at all do not lift."""

BISECTION_WIDTH = 1e-4
"""Width at which a bisection ends, relative to its first interval."""

MAX_CYCLE_DOUBLINGS = 12
"""How often the cycle time is doubled in the search for one that the joints can follow."""

CHECKED_GAITS = 256
"""How many pairs of robot and gait are remembered as checked."""


def refuse_impossible(robot: Robot, gait: Gait, motion: BodyMotion | None = None) -> None:
    """Check a whole walk, start to stop, before anything runs; once for a robot and a gait.

    Args:
        robot: the robot.
        gait: the gait.
        motion: constant offsets of the trunk; None: none.

    Raises:
        GaitError: naming leg, joint, value and limit, and the largest request that works.
    """
    six, bodies = six_legs(robot), leg_bodies(robot)
    found = _find_refusal(six, bodies, gait, motion)
    if found is None:
        return
    if motion is not None and _find_refusal(six, bodies, gait, None) is None:
        raise _refuse_motion(six, bodies, gait, motion)
    raise GaitError(*found)


def _refuse_motion(six: SixLegs, bodies: LegBodies, gait: Gait, motion: BodyMotion) -> GaitError:
    """Return the error of offsets with which a gait fails that works without them."""

    def reaches(share: float) -> bool:
        return violation(six, gait, motion.scaled(share)) is None

    beyond = violation(six, gait, motion)
    found = beyond or collision(six, bodies, gait, motion)
    asked = ", ".join(f"{name}={value:g}" for name, value in motion.offsets.items())
    reason = f"gait {gait.name} with BodyMotion({asked}): "
    reason += "" if found is None else f"{found.text.rstrip('.')}."
    largest = 0.0 if beyond is None else bisect(reaches, good=0.0, bad=1.0)
    if largest == 0.0 or collision(six, bodies, gait, motion.scaled(largest)) is not None:
        return GaitError(f"{reason} The gait works without these offsets.", "body", None)
    most = ", ".join(f"{name}={largest * value:.4g}" for name, value in motion.offsets.items())
    hint = f" With the rest unchanged the furthest that works is BodyMotion({most})."
    if len(motion.offsets) > 1:
        return GaitError(reason + hint, "body", None)
    ((name, value),) = motion.offsets.items()
    return GaitError(reason + hint, name, largest * value)


def refuse_impossible_command(
    robot: Robot, gait: Gait, command: VelocityCommand, until: float
) -> None:
    """Check each speed and turn rate of a command, up to a time [s], as a walk of its own.

    Raises:
        GaitError: naming the time of the command, and the largest speed that works.
    """
    for time, asked in command.gaits(gait):
        if time > until:
            return
        try:
            refuse_impossible(robot, asked)
        except GaitError as error:
            quantity, limit = error.quantity, error.limit
            hint = ""
            if quantity == "stroke" and limit is not None:
                quantity, limit = "speed", limit / (gait.duty * gait.cycle_time)
                hint = f" That is a speed of at most {limit:.4g} m/s."
            where = f"VelocityCommand at t = {time:g} s ({asked.speed:.4g} m/s)"
            raise GaitError(f"{where}: {error}{hint}", quantity, limit) from None


@lru_cache(maxsize=CHECKED_GAITS)
def _find_refusal(
    six: SixLegs, bodies: LegBodies, gait: Gait, motion: BodyMotion | None
) -> tuple[str, str, float | None] | None:
    """Return message, quantity and limit of the error that refuses a gait, None if it works."""

    def legs_reach(other: Gait) -> bool:
        return violation(six, other, motion) is None

    def legs_pass(other: Gait) -> bool:
        try:
            return legs_reach(other) and collision(six, bodies, other, motion) is None
        except ReachError:  # at the very limit, between the places where it was checked
            return False

    found = violation(six, gait, motion)
    if found is not None:
        error = refusal(found, legs_reach, gait)
        if error.limit is None or legs_pass(gait.with_changes(**{error.quantity: error.limit})):
            return str(error), error.quantity, error.limit
    elif (found := collision(six, bodies, gait, motion)) is None:
        return None
    error = refusal(found, legs_pass, gait)
    return str(error), error.quantity, error.limit


def refusal(found: Violation, works: Callable[[Gait], bool], gait: Gait) -> GaitError:
    """Return the error that says what to change, and how far.

    Args:
        found: the violation of `gait`.
        works: tells whether another gait can be walked.
        gait: the refused gait.
    """
    reason = f"gait {gait.name}: {found.text.rstrip('.')}."
    if found.kind == POSTURE:
        return GaitError(reason, "posture", None)
    if found.kind == RATE:
        return _refuse_rate(reason, works, gait)
    return _refuse_path(reason, works, gait)


def _refuse_rate(reason: str, works: Callable[[Gait], bool], gait: Gait) -> GaitError:
    """Name the shortest cycle time at which the joints keep up."""

    def slower(cycle_time: float) -> bool:
        return works(gait.with_changes(cycle_time=cycle_time))

    ceiling = gait.cycle_time
    for _ in range(MAX_CYCLE_DOUBLINGS):
        ceiling *= 2.0
        if slower(ceiling):
            limit = bisect(slower, good=ceiling, bad=ceiling / 2.0)
            text = f"{reason} With the rest unchanged, cycle_time must be at least {limit:.4g} s."
            return GaitError(text, "cycle_time", limit)
    return _refuse_path(reason, works, gait)


def _refuse_path(reason: str, works: Callable[[Gait], bool], gait: Gait) -> GaitError:
    """Name the largest stroke, lift or turn rate, whichever is the culprit."""

    def shorter(stroke: float) -> bool:
        return works(gait.with_changes(stroke=stroke))

    def lower(lift: float) -> bool:
        return works(gait.with_changes(lift=lift))

    def straighter(turn_rate: float) -> bool:
        return works(gait.with_changes(turn_rate=turn_rate))

    least = min(gait.stroke, NEGLIGIBLE_STROKE)
    if least < gait.stroke and shorter(least):
        limit = bisect(shorter, good=least, bad=gait.stroke)
        text = f"{reason} With the rest unchanged, stroke can be at most {limit:.4g} m"
        if lower(0.0):
            lift = bisect(lower, good=0.0, bad=gait.lift)
            text += f" (or, at this stroke, lift {lift:.4g} m)"
        return GaitError(text + ".", "stroke", limit)
    if lower(0.0):
        limit = bisect(lower, good=0.0, bad=gait.lift)
        return GaitError(
            f"{reason} With the rest unchanged, lift can be at most {limit:.4g} m.", "lift", limit
        )
    if straighter(0.0):
        limit = bisect(straighter, good=0.0, bad=gait.turn_rate)
        text = f"{reason} With the rest unchanged, turn_rate can be at most {limit:.4g} rad/s."
        return GaitError(text, "turn_rate", limit)
    return GaitError(f"{reason} No smaller stroke, lift or turn rate alone helps.", "posture", None)


def bisect(works: Callable[[float], bool], *, good: float, bad: float) -> float:
    """Return the value nearest to `bad` that is known to work, to BISECTION_WIDTH."""
    width = BISECTION_WIDTH * abs(bad - good)
    while abs(bad - good) > width:
        middle = 0.5 * (good + bad)
        if works(middle):
            good = middle
        else:
            bad = middle
    return good
