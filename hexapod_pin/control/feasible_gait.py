"""A gait is chosen by name, with the stroke, lift and cycle time that the robot can walk."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hexapod_pin.arguments import checked
from hexapod_pin.control.feasibility import shortest_cycle, violation
from hexapod_pin.control.gait import GAITS, Gait, gaits_for
from hexapod_pin.control.gait_refusal import collision, refuse_impossible
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.errors import GaitError, ParameterError, UnknownNameError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.holding_torque import STANDARD_GRAVITY
from hexapod_pin.robot.leg_bodies import leg_bodies
from hexapod_pin.robot.robot import leg_length

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


DEFAULT_STROKE = float(Gait.model_fields["stroke"].default)
"""Stroke of S2 [m], of legs as long as those of the packaged robots."""

STROKE_SHARE = 0.8
"""Share of the largest possible stroke taken where the default one is too long (*assumed*)."""

DEFAULT_LIFT = float(Gait.model_fields["lift"].default)
DEFAULT_CYCLE = float(Gait.model_fields["cycle_time"].default)

REFERENCE_LEGS = (0.30, 0.38)
"""Lengths of legs that walk S2's gait as it is, kharagpur's 0.302 m to athena's 0.38 m [m].

Shorter and longer legs walk it scaled by their length over the nearer of these: stroke and lift in
proportion, the cycle with the root, so that the Froude number v^2 / (g L) stays that of S2's gait
(dynamic similarity: Alexander & Jayes 1983).
"""

LARGEST_SCALE = 10.0
"""Of S2's gait: beyond it lengths are rather in another unit [-]."""

SCALED_DIGITS = 3
"""Significant digits of the numbers of a scaled gait."""

RATE_SHARE = 0.8
"""Largest joint rate over its limit, where the default cycle is too short (*assumed*)."""

CYCLE_STEP = 0.1
"""A chosen cycle time is a whole number of these [s]."""

MUCH_LONGER = 1.5
"""Cycle time over that of S2's gait, scaled, from which slow joints are named first [-]."""

UNHURRIED = 1e4
"""Cycle time at which a stroke is fitted where the cycle is chosen afterwards [s]."""

MOST_TRIES = 8
"""How often the cycle of a turning gait, whose paths depend on it, is made longer."""

DEFAULT, GIVEN, SCALED = "default", "as given", "scaled to its legs"


@dataclass(frozen=True)
class FittedGait(Immutable):
    """A gait and the source of its numbers: "default", "as given", or the reason.

    Attributes:
        gait: the gait.
        stroke: of its stroke.
        cycle_time: of its cycle time.
        lift: of its lift.
        scale: length of the legs over that of legs that walk S2's gait; 1: it is S2's.
        froude: its Froude number v^2 / (g L), L the length of the legs [-].
        wanted: stroke that was wanted, given or the default one [m].
        limit: what keeps the stroke from that; empty where nothing does.
    """

    gait: Gait
    stroke: str
    cycle_time: str
    lift: str
    scale: float = 1.0
    froude: float = 0.0
    wanted: float = 0.0
    limit: str = ""

    @property
    def shortage(self) -> str:
        """How much of the stroke that was wanted there is, and what limits it, in a few words."""
        lengths = f"stroke {1e3 * self.gait.stroke:.3g} of {1e3 * self.wanted:.3g} mm"
        return f"{lengths} ({self.limit})" if self.limit else lengths

    @property
    def slowness(self) -> str:
        """That slow joints stretch the cycle, in a few words; empty where they do not much."""
        slow = self.cycle_time not in (DEFAULT, GIVEN, SCALED)
        usual = DEFAULT_CYCLE * math.sqrt(self.scale)
        if not slow or self.gait.cycle_time < MUCH_LONGER * usual:
            return ""
        return f"cycle {self.gait.cycle_time:.3g} s: its joints are slow"

    @property
    def remarks(self) -> tuple[str, ...]:
        """Where the gait is not S2's as it is, and why, a few words each."""
        gait = self.gait
        numbers = {
            f"stroke {1e3 * gait.stroke:.3g} mm": self.stroke,
            f"cycle {gait.cycle_time:.3g} s": self.cycle_time,
            f"lift {1e3 * gait.lift:.3g} mm": self.lift,
        }
        scaled = [what for what, why in numbers.items() if why == SCALED]
        found = [
            f"{what} ({why})"
            for what, why in numbers.items()
            if why not in (DEFAULT, GIVEN, SCALED)
        ]
        if scaled:
            found.insert(0, f"{', '.join(scaled)}: S2's gait {SCALED} ({self.scale:.3g} times)")
        return tuple(found)


@checked
def feasible_gait(
    robot: Robot, name: str, stroke: float | None, **fields: float
) -> tuple[Gait, str]:
    """Return the gait of `fit_gait`, and how its stroke was chosen; arguments and errors as there.

    Args:
        robot: the robot that must be able to walk it.
        name: of the gait.
        stroke: [m], or None.
        fields: cycle_time, lift, duty, heading, turn_rate, speed.
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
    speed: float | None = None,
    **fields: float,
) -> FittedGait:
    """Return a gait that the robot can walk, with the values given and the others fitted.

    Stroke, lift and cycle are S2's 0.14 m, 0.02 m and 2.4 s, scaled by the length of the legs
    (`REFERENCE_LEGS`). The stroke is 80 % of the largest that the robot can walk where that is
    less, and the lift likewise. Where a joint is too slow for the cycle, it is one in which no
    joint is faster than 80 % of its velocity limit.

    Args:
        robot: the robot that must be able to walk it.
        name: "tripod", "ripple", "tetrapod" or "wave", as the number of legs allows.
        stroke: [m]; None: fitted.
        cycle_time: [s]; None: fitted.
        lift: [m]; None: fitted.
        speed: of the walk [m/s]; it sets the cycle time, beside a cycle time the stroke. None:
            what follows from these.
        fields: duty, heading, turn_rate.

    Raises:
        UnknownNameError: there is no such gait for the robot's number of legs.
        GaitError: the robot cannot walk it, whatever the numbers that were not given.
        ParameterError: a value is out of range, or a speed beside both stroke and cycle time.

    Example:
        >>> robot = hp.load_robot("athena")
        >>> gait = hp.motion.fit_gait(robot, hp.motion.default_gait(robot)).gait
    """
    scale = gait_scale(robot)
    if speed is not None and not speed > 0.0:
        raise ParameterError("speed", speed, "above 0 m/s")
    if speed is not None and cycle_time is not None:
        if stroke is not None:
            allowed = "left out beside both stroke and cycle_time, which set it"
            raise ParameterError("speed", speed, allowed)
        duty = named_gait(robot, name, **fields).duty
        stroke = speed * duty * cycle_time
    height = _scaled(DEFAULT_LIFT, scale) if lift is None else lift
    usual = _scaled(DEFAULT_CYCLE, math.sqrt(scale)) if cycle_time is None else cycle_time
    standard = DEFAULT if scale == 1.0 else SCALED
    lift_source = standard if lift is None else GIVEN

    def gait_of(length: float, high: float) -> Gait:
        return named_gait(robot, name, stroke=length, lift=high, cycle_time=usual, **fields)

    def timed(gait: Gait) -> Gait:
        return gait if cycle_time is not None else _slow_enough(robot, gait)

    wanted = length = _scaled(DEFAULT_STROKE, scale) if stroke is None else stroke
    stroke_source = standard if stroke is None else GIVEN
    free, limit = cycle_time is None, ""
    largest = _refused(robot, timed(gait_of(length, height)), free)
    if largest is not None and largest.quantity == "lift" and lift is None and largest.limit:
        height = STROKE_SHARE * largest.limit
        lift_source = f"{STROKE_SHARE:.0%} of the highest that fits"
        largest = _refused(robot, timed(gait_of(length, height)), free)
    if largest is not None:
        if stroke is not None or largest.quantity != "stroke" or largest.limit is None:
            raise largest
        limit = stroke_limit(robot, gait_of(largest.limit, height), length)
        length = STROKE_SHARE * largest.limit
        stroke_source = f"{STROKE_SHARE:.0%} of the longest that fits, {1e3 * largest.limit:.3g} mm"
    gait = timed(gait_of(length, height))
    cycle_source = _cycle_source(gait, usual, GIVEN if cycle_time is not None else standard)
    if speed is not None and cycle_time is None:
        gait = _at_speed(robot, gait, speed)
        cycle_source = f"at {speed:g} m/s"
    refuse_impossible(robot, gait)
    froude = gait.speed**2 / (STANDARD_GRAVITY * leg_length(robot))
    return FittedGait(gait, stroke_source, cycle_source, lift_source, scale, froude, wanted, limit)


def gait_scale(robot: Robot) -> float:
    """Return the length of a robot's legs over the nearer end of `REFERENCE_LEGS` [-]."""
    length, (low, high) = leg_length(robot), REFERENCE_LEGS
    return min(length / min(max(length, low), high * (1.0 + 1e-9)), LARGEST_SCALE)


def _scaled(value: float, factor: float) -> float:
    """Return a number of S2's gait times a factor, with few digits; as it is where that is 1."""
    return value if factor == 1.0 else float(f"{factor * value:.{SCALED_DIGITS}g}")


def _at_speed(robot: Robot, gait: Gait, speed: float) -> Gait:
    """Return a gait with the cycle time of a speed [m/s].

    Raises:
        GaitError: the joints are too slow for it; it names the largest speed.
        ParameterError: the gait does not travel.
    """
    if gait.stroke == 0.0:
        raise ParameterError("speed", speed, "left out of a gait whose stroke is 0")
    cycle = gait.stroke / (gait.duty * speed)
    found = gait.with_changes(cycle_time=cycle)
    try:
        refuse_impossible(robot, found)
    except GaitError as error:
        if error.quantity != "cycle_time" or error.limit is None:
            raise
        most = gait.stroke / (gait.duty * error.limit)
        text = str(error).partition(" With the rest")[0]
        text = f"{text} With the rest unchanged, speed can be at most {most:.4g} m/s."
        raise GaitError(text, "speed", most) from None
    return found


BEYOND = 1.01
"""A stroke over the longest that fits, at which what limits it shows [-]."""


def stroke_limit(robot: Robot, gait: Gait, wanted: float) -> str:
    """Return what keeps a stroke from being longer, in a few words.

    Args:
        robot: that walks.
        gait: with the longest stroke that fits.
        wanted: stroke [m].
    """
    longer = gait.with_changes(stroke=min(wanted, BEYOND * gait.stroke))
    if gait.turn_rate == 0.0:  # paths of a turning gait depend on its cycle
        longer = longer.with_changes(cycle_time=UNHURRIED)
    six = leg_group(robot)
    found = violation(six, longer) or collision(six, leg_bodies(robot), longer)
    return "" if found is None else found.brief


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


def _cycle_source(gait: Gait, usual: float, source: str) -> str:
    if gait.cycle_time == usual:
        return source
    return f"joints at {RATE_SHARE:.0%} of their velocity limits; {usual:.3g} s is too short"


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
    legs = leg_group(robot).legs
    try:
        return Gait.by_name(name, legs=len(legs), **values)
    except UnknownNameError as error:
        if name not in GAITS or not robot.held:
            raise
        found = ", ".join(leg.name for leg in legs)
        what = f"gait of {len(legs)} legs ({found}; no leg: {', '.join(robot.held)})"
        raise UnknownNameError(what, name, error.known) from None
