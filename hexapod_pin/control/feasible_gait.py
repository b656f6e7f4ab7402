"""A gait is chosen by name, with the stroke, lift and cycle time that the robot can walk."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hexapod_pin.arguments import checked
from hexapod_pin.control.feasibility import shortest_cycle
from hexapod_pin.control.gait import Gait, gaits_for
from hexapod_pin.control.gait_refusal import refuse_impossible
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.errors import GaitError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.leg_geometry import leg_length

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


DEFAULT_STROKE = 0.14
"""Stroke of S2 [m], taken where none is given and the robot can walk it."""

STROKE_SHARE = 0.8
"""Share of the largest possible stroke taken where DEFAULT_STROKE is too long (*assumed*)."""

DEFAULT_LIFT = float(Gait.model_fields["lift"].default)
DEFAULT_CYCLE = float(Gait.model_fields["cycle_time"].default)

LIFT_SHARE = 0.08
"""Largest lift taken over the length of a leg, where none is given (*assumed*)."""

RATE_SHARE = 0.8
"""Largest joint rate over its limit, where DEFAULT_CYCLE is too short (*assumed*)."""

CYCLE_STEP = 0.1
"""A chosen cycle time is a whole number of these [s]."""

UNHURRIED = 1e4
"""Cycle time at which a stroke is fitted where the cycle is chosen afterwards [s]."""

MOST_TRIES = 8
"""How often the cycle of a turning gait, whose paths depend on it, is made longer."""

DEFAULT, GIVEN = "default", "as given"


@dataclass(frozen=True)
class FittedGait(Immutable):
    """A gait and the source of its numbers: "default", "as given", or the reason.

    Attributes:
        gait: the gait.
        stroke: of its stroke.
        cycle_time: of its cycle time.
        lift: of its lift.
    """

    gait: Gait
    stroke: str
    cycle_time: str
    lift: str


@checked
def feasible_gait(
    robot: Robot, name: str, stroke: float | None, **fields: float
) -> tuple[Gait, str]:
    """Return the gait of `fit_gait`, and how its stroke was chosen; arguments and errors as there.

    Args:
        robot: the robot that must be able to walk it.
        name: of the gait.
        stroke: [m], or None.
        fields: cycle_time, lift, duty, heading, turn_rate.
    """
    fitted = fit_gait(robot, name, stroke, **fields)
    return fitted.gait, fitted.stroke


@checked
def fit_gait(
    robot: Robot,
    name: str,
    stroke: float | None = None,
    *,
    cycle_time: float | None = None,
    lift: float | None = None,
    **fields: float,
) -> FittedGait:
    """Return a gait that the robot can walk, with the values given and the others fitted.

    The stroke is 0.14 m (S2's), or 80 % of the largest that the robot can walk where that is less.
    The lift is 0.02 m, or 8 % of the length of a leg where that is less, or 80 % of the largest
    that it can walk. The cycle is 2.4 s (S2's), or, where a joint is too slow for it, one in which
    no joint is faster than 80 % of its velocity limit.

    Args:
        robot: the robot that must be able to walk it.
        name: one of `control.gait.GAITS`.
        stroke: [m]; None: fitted.
        cycle_time: [s]; None: fitted.
        lift: [m]; None: fitted.
        fields: duty, heading, turn_rate.

    Raises:
        UnknownNameError: there is no such gait for the robot's number of legs.
        GaitError: the robot cannot walk it, whatever the numbers that were not given.
        ParameterError: a value is out of range.
    """
    height, lift_source = _lift(robot, lift)

    def gait_of(length: float, high: float) -> Gait:
        cycle = DEFAULT_CYCLE if cycle_time is None else cycle_time
        return named_gait(robot, name, stroke=length, lift=high, cycle_time=cycle, **fields)

    def timed(gait: Gait) -> Gait:
        return gait if cycle_time is not None else _slow_enough(robot, gait)

    length, stroke_source = (DEFAULT_STROKE, DEFAULT) if stroke is None else (stroke, GIVEN)
    free = cycle_time is None
    largest = _refused(robot, timed(gait_of(length, height)), free)
    if largest is not None and largest.quantity == "lift" and lift is None and largest.limit:
        height = STROKE_SHARE * largest.limit
        lift_source = f"chosen: {STROKE_SHARE:.0%} of the highest that fits"
        largest = _refused(robot, timed(gait_of(length, height)), free)
    if largest is not None:
        if stroke is not None or largest.quantity != "stroke" or largest.limit is None:
            raise largest
        length = STROKE_SHARE * largest.limit
        stroke_source = (
            f"chosen: {STROKE_SHARE:.0%} of the largest that fits, {largest.limit:.4g} m, "
            f"because {DEFAULT_STROKE} m does not"
        )
    gait = timed(gait_of(length, height))
    refuse_impossible(robot, gait)
    return FittedGait(gait, stroke_source, _cycle_source(gait, cycle_time), lift_source)


def _lift(robot: Robot, lift: float | None) -> tuple[float, str]:
    """Return the lift [m] and how it was chosen."""
    if lift is not None:
        return lift, GIVEN
    most = LIFT_SHARE * leg_length(robot)
    if most >= DEFAULT_LIFT:
        return DEFAULT_LIFT, DEFAULT
    return most, f"chosen: {LIFT_SHARE:.0%} of a leg's length, because {DEFAULT_LIFT:g} m is more"


def _slow_enough(robot: Robot, gait: Gait) -> Gait:
    """Return the gait, with a longer cycle where its joints would be beyond their velocity limits.

    Then no joint exceeds RATE_SHARE of its limit. A gait whose paths the robot cannot walk is
    returned as it is: it is refused by them.
    """
    for tries in range(MOST_TRIES):
        least = shortest_cycle(leg_group(robot), gait)
        share = 1.0 if tries == 0 else RATE_SHARE
        if least is None or least <= share * gait.cycle_time:
            return gait
        longer = CYCLE_STEP * math.ceil(least / RATE_SHARE / CYCLE_STEP)
        gait = gait.with_changes(cycle_time=round(longer, 9))
    return gait


def _refused(robot: Robot, gait: Gait, free: bool) -> GaitError | None:
    """Return why a robot cannot walk a gait; where the cycle is free, at a slow enough one.

    Paths do not depend on the cycle time where a gait does not turn: they are fitted with a long
    cycle, so that joint rates do not shorten the stroke.
    """
    try:
        refuse_impossible(robot, gait)
    except GaitError as error:
        if not free or gait.turn_rate != 0.0:
            return error
        return _refused(robot, gait.with_changes(cycle_time=UNHURRIED), free=False) or error
    return None


def _cycle_source(gait: Gait, given: float | None) -> str:
    if given is not None:
        return GIVEN
    if gait.cycle_time == DEFAULT_CYCLE:
        return DEFAULT
    return (
        f"chosen: no joint faster than {RATE_SHARE:.0%} of its velocity limit; {DEFAULT_CYCLE:g} s "
        "is too short"
    )


# Gaits by name for a robot with any number of legs.

PREFERRED = ("tetrapod", "wave")
"""The first of these that a robot's legs can walk is its default."""


@checked
def default_gait(robot: Robot) -> str:
    """Return the name of a robot's default gait.

    "tetrapod" with six legs ([S2]'s) and with eight; "wave" with four, five or seven.

    Raises:
        GaitError: the robot has no legs that a gait can move.
    """
    fitting = gaits_for(len(leg_group(robot).legs))
    return next(name for name in PREFERRED if name in fitting)


@checked
def named_gait(robot: Robot, name: str, **fields: float) -> Gait:
    """Return a gait of `GAITS` for a robot's number of legs.

    Args:
        robot: whose legs walk.
        name: of the gait.
        fields: stroke, cycle_time, duty (wave), lift, heading, turn_rate.

    Raises:
        UnknownNameError: no gait of that name fits so many legs; lists those that do.
        GaitError: the robot has no legs that a gait can move.
        ParameterError: a value is out of range.
    """
    values: dict[str, Any] = fields
    return Gait.by_name(name, legs=len(leg_group(robot).legs), **values)
