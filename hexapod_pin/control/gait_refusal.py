"""A refused gait is reported with the change that would make it possible.

Legs may not come too near to each other or to the trunk.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.control.feasibility import (
    PATH,
    POSTURE,
    RATE,
    SAMPLES_PER_CYCLE,
    Violation,
    checked_path,
    checked_times,
    checked_walk,
    violation,
)
from hexapod_pin.control.gait import LONGEST_CYCLE, Gait
from hexapod_pin.control.leg_group import LegGroup, leg_group
from hexapod_pin.errors import GaitError, ReachError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.description.urdf_file import parse_urdf
from hexapod_pin.robot.leg_bodies import LegBodies, leg_bodies

if TYPE_CHECKING:
    from hexapod_pin.control.body_motion import BodyMotion
    from hexapod_pin.control.commanded_body import VelocityCommand
    from hexapod_pin.robot.robot import Robot


NEGLIGIBLE_STROKE = 1e-6
"""A stroke that tests the lift alone [m]: feet that do not travel at all do not lift."""

BISECTION_WIDTH = 1e-4
"""Width at which a bisection ends, relative to its first interval."""

MAX_CYCLE_DOUBLINGS = 12
"""How often the cycle time is doubled in the search for one that the joints can follow."""

CHECKED_GAITS = 256
"""How many results for pairs of robot and gait are cached."""


def refuse_impossible(robot: Robot, gait: Gait, motion: BodyMotion | None = None) -> None:
    """Check a whole walk, start to stop, before the run; once for a robot and a gait.

    Args:
        robot: the robot.
        gait: the gait.
        motion: constant offsets of the trunk; None: none.

    Raises:
        GaitError: naming leg, joint, value and limit, and the largest request that works.
    """
    six, bodies = leg_group(robot), leg_bodies(robot)
    found = _find_refusal(six, bodies, gait, motion)
    if found is None:
        return
    if motion is not None and _find_refusal(six, bodies, gait, None) is None:
        raise _refuse_motion(six, bodies, gait, motion)
    raise GaitError(*found)


def _refuse_motion(six: LegGroup, bodies: LegBodies, gait: Gait, motion: BodyMotion) -> GaitError:
    """Return the error of offsets with which a gait fails that works without them."""

    def reaches(share: float) -> bool:
        return violation(six, gait, motion.scaled(share)) is None

    beyond = violation(six, gait, motion)
    found = beyond or collision(six, bodies, gait, motion)
    offsets = ", ".join(f"{name}={value:g}" for name, value in motion.offsets.items())
    reason = f"gait {gait.name} with BodyMotion({offsets}): "
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
    for time, steady in command.gaits(gait):
        if time > until:
            return
        try:
            refuse_impossible(robot, steady)
        except GaitError as error:
            quantity, limit = error.quantity, error.limit
            hint = ""
            if quantity == "stroke" and limit is not None:
                quantity, limit = "speed", limit / (gait.duty * gait.cycle_time)
                hint = f" That is a speed of at most {limit:.4g} m/s."
            where = f"VelocityCommand at t = {time:g} s ({steady.speed:.4g} m/s)"
            raise GaitError(f"{where}: {error}{hint}", quantity, limit) from None


@lru_cache(maxsize=CHECKED_GAITS)
def _find_refusal(
    six: LegGroup, bodies: LegBodies, gait: Gait, motion: BodyMotion | None
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
    """Return the error that names what to change, and how far."""
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

    limit = shortest_working_cycle(slower, gait.cycle_time)
    if limit is None:
        return _refuse_path(reason, works, gait)
    text = f"{reason} With the rest unchanged, cycle_time must be at least {limit:.4g} s."
    return GaitError(text, "cycle_time", limit)


def shortest_working_cycle(works: Callable[[float], bool], cycle_time: float) -> float | None:
    """Return the shortest cycle time that works, above one that does not [s]; None if not found."""
    for _ in range(MAX_CYCLE_DOUBLINGS):
        cycle_time *= 2.0
        if cycle_time > LONGEST_CYCLE:
            return None
        if works(cycle_time):
            return bisect(works, good=cycle_time, bad=0.5 * cycle_time)
    return None


def _refuse_path(reason: str, works: Callable[[Gait], bool], gait: Gait) -> GaitError:
    """Name the largest stroke, lift or turn rate, whichever has to change."""

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


# How near the legs come to each other and to the trunk in a planned walk.

CLEARANCE_STRIDE = 5
"""Distances are computed at every fifth checked time, 60 in a cycle."""

REFINEMENT = 16
"""Around the nearest of these so many times as many."""

MIN_CLEARANCE = 3e-3
"""Links that come nearer than this are reported [m] (*assumed*)."""

TOUCHING = 1e-6
"""An overlap up to this is rounding [m]: the links just touch."""

EQUAL_DISTANCES = 1e-9
"""Distances that differ by less are taken as equal: the first one in time is named [m]."""


@dataclass(frozen=True)
class Clearance(Immutable):
    """Where two links come nearest to each other in a walk: start, one steady cycle, stop.

    Attributes:
        links: names of the two links, of two legs or of a leg and the trunk.
        time: when, from the start of the walk [s].
        distance: between their surfaces [m]; negative is how deep they overlap.
        excluded: pairs of links that overlap in the standing posture and so were not checked.
        assumed: what is assumed of the links' shapes.
    """

    links: tuple[str, str]
    time: float
    distance: float
    excluded: tuple[tuple[str, str], ...] = ()
    assumed: str = ""

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings: links that come very near, and pairs that were not checked."""
        found = []
        if self.distance < MIN_CLEARANCE:
            where = f"at {self.time:.3g} s of the walk"
            found.append(f"links {' and '.join(self.links)} {self.nearness} {where}")
        if self.excluded:
            pairs = ", ".join(" and ".join(pair) for pair in self.excluded)
            found.append(f"not checked, because they overlap where the robot stands: {pairs}")
        return tuple(found)

    @property
    def nearness(self) -> str:
        """How near, as text: "overlap by 0.01 m", "come within 1 mm of each other"."""
        if abs(self.distance) <= TOUCHING:
            return "touch each other"
        if self.distance < 0.0:
            return f"overlap by {-self.distance:.4g} m"
        return f"come within {1e3 * self.distance:.2g} mm of each other"


@checked
def leg_clearance(robot: Robot, gait: Gait) -> Clearance:
    """Return where links of different legs, or of a leg and the trunk, come nearest in a walk.

    Computed once for a robot and a gait.

    Raises:
        GaitError: the robot does not have six legs.
        ReachError: the feet cannot follow the gait.
    """
    return clearance(leg_group(robot), leg_bodies(robot), gait)


def overlaps(robot: Robot, gait: Gait) -> tuple[str, ...]:
    """Return that legs stand in each other, in a few words; nothing of legs that are apart.

    Legs that overlap as the robot stands are not checked in its walk. Of a leg and the trunk this
    is common: shapes of hips reach into it.
    """
    legs = {name: leg.name for leg in robot.legs for name in _links_of(robot, leg.joints)}
    pairs = {
        tuple(sorted((legs[a], legs[b])))
        for a, b in leg_clearance(robot, gait).excluded
        if a in legs and b in legs and legs[a] != legs[b]
    }
    if not pairs:
        return ()
    (one, other), more = min(pairs), len(pairs) - 1
    others = f" and {more} more pairs" if more > 1 else " and one more pair" if more else ""
    return (f"legs {one} and {other}{others} stand in each other",)


def _links_of(robot: Robot, joints: Sequence[str]) -> list[str]:
    """Return the links that joints move, and those fixed to them."""
    file = parse_urdf(robot.urdf.encode(), robot.source)
    children = [joint.child for joint in file.joints if joint.name in joints]
    return [name for child in children for name in file.rigid_group(child)]


@lru_cache(maxsize=CHECKED_GAITS)
def clearance(
    six: LegGroup, bodies: LegBodies, gait: Gait, motion: BodyMotion | None = None
) -> Clearance:
    """Return the clearance of a gait, as `leg_clearance`; `motion` is the trunk's, constant."""
    found = _clearance(six, bodies, gait.in_one_second(), motion)
    return replace(found, time=found.time * gait.cycle_time)


@lru_cache(maxsize=CHECKED_GAITS)
def _clearance(
    six: LegGroup, bodies: LegBodies, gait: Gait, motion: BodyMotion | None
) -> Clearance:
    """Return the clearance of a gait in one second; times scale with the cycle."""
    if not bodies.pairs:
        return Clearance(("", ""), 0.0, np.inf, bodies.excluded, bodies.assumed)
    six = six.along(gait)
    path = checked_path(six, gait, motion)
    walk = checked_walk(six, gait, motion)
    if isinstance(walk, Violation):
        time = checked_times(path)[::CLEARANCE_STRIDE]
        q = six.kinematics.inverse(six.foot_motion(path, time)[0])
    else:
        time, q = walk.time[::CLEARANCE_STRIDE], walk.q[:, ::CLEARANCE_STRIDE]
    row = _first_smallest(bodies.distances(with_base(six, q))[0])
    width = gait.cycle_time * CLEARANCE_STRIDE / SAMPLES_PER_CYCLE
    around = time[row] + np.linspace(-width, width, 2 * REFINEMENT + 1)
    around = np.clip(around, 0.0, time[-1])
    p_BF, _ = six.foot_motion(path, around)
    nearby = six.kinematics.inverse(p_BF, q[:, max(row - 1, 0)])
    distance, nearest = bodies.distances(with_base(six, nearby))
    row = _first_smallest(distance)
    pair, at = bodies.pairs[nearest[row]], float(around[row])
    return Clearance(pair, at, float(distance[row]), bodies.excluded, bodies.assumed)


def collision(
    six: LegGroup, bodies: LegBodies, gait: Gait, motion: BodyMotion | None = None
) -> Violation | None:
    """Return the violation of links that overlap, or None if none do.

    Args:
        six: the legs, whose feet can follow the gait.
        bodies: their shapes.
        gait: the gait.
        motion: constant offsets of the trunk; None: none.
    """
    found = clearance(six, bodies, gait, motion)
    if found.distance >= -TOUCHING:
        return None
    shapes = f" (shapes: {found.assumed})" if found.assumed else ""
    return Violation(
        PATH,
        f"links {' and '.join(found.links)} {found.nearness} at {found.time:.4g} s{shapes}",
        f"{' meets '.join(found.links)}",
    )


def with_base(six: LegGroup, q: Array) -> Array:
    """Return configurations (K, 7 + n) of legs' angles (L, K, J) [rad], the base at the origin."""
    angles = six.joint_rows(q, six.posture)
    base = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (len(angles), 1))
    return np.hstack([base, angles])


def _first_smallest(distance: Array) -> int:
    """Return the first of the smallest distances, rounding aside."""
    return int(np.argmax(distance <= distance.min() + EQUAL_DISTANCES))
