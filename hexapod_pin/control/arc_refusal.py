"""The refusal of a walk on arcs: what to change in the request, and how far."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.arc_path import ArcPath, StanceProfile
from hexapod_pin.control.feasibility import (
    CHECKED_CYCLES,
    MAX_FOOT_HEIGHT_SPREAD,
    PATH,
    RATE,
    Violation,
    posture_violation,
)
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.gait_refusal import MAX_CYCLE_DOUBLINGS, bisect
from hexapod_pin.control.knot_table import knot_times
from hexapod_pin.control.leg_clearance import TOUCHING
from hexapod_pin.control.six_legs import SixLegs, require_six_of_three
from hexapod_pin.errors import GaitError
from hexapod_pin.robot.leg_bodies import LegBodies, leg_bodies
from hexapod_pin.robot.leg_geometry import ANGLE_TOLERANCE

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

CHECK_SPACING_CYCLES = 1.0 / 60.0
"""Largest spacing of the checked times; the extremes of the angles are among them [cycles]."""

NEGLIGIBLE_ANGLE = 1e-4
"""An amplitude or lift that tests the other one alone [rad]."""

CHECKED_WALKS = 64
"""How many walks are remembered as checked."""


@lru_cache(maxsize=CHECKED_WALKS)
def _find_refusal(
    six: SixLegs,
    bodies: LegBodies,
    gait: Gait,
    amplitude: float,
    lift_angle: float,
    profile: StanceProfile,
) -> tuple[str, str, float | None] | None:
    """Return message, quantity and limit of the error that refuses a walk; None if it works."""

    def violation(gait: Gait, amplitude: float, lift: float) -> Violation | None:
        return _violation(six, bodies, gait, amplitude, lift, profile)

    found = violation(gait, amplitude, lift_angle)
    if found is None:
        return None
    reason = f"arc walk: {found.text}."
    if found.kind == RATE:

        def slower(period: float) -> bool:
            return violation(gait.with_changes(cycle_time=period), amplitude, lift_angle) is None

        limit = _slowest(slower, gait.cycle_time)
        if limit is not None:
            text = f"{reason} With the rest unchanged, cycle_time must be at least {limit:.4g} s."
            return text, "cycle_time", limit
    trials: dict[str, tuple[Callable[[float], bool], float]] = {
        "amplitude": (lambda a: violation(gait, a, lift_angle) is None, amplitude),
        "lift_angle": (lambda lift: violation(gait, amplitude, lift) is None, lift_angle),
    }
    for name, (works, asked) in trials.items():
        if asked > NEGLIGIBLE_ANGLE and works(NEGLIGIBLE_ANGLE):
            limit = bisect(works, good=NEGLIGIBLE_ANGLE, bad=asked)
            text = f"{reason} With the rest unchanged, {name} can be at most {limit:.4g} rad."
            return text, name, limit
    return f"{reason} No smaller amplitude or lift angle alone helps.", "posture", None


def refuse_impossible_arc(
    robot: Robot, gait: Gait, amplitude: float, lift_angle: float, profile: StanceProfile
) -> None:
    """Check a whole walk on arcs, start to stop, before anything runs.

    Args:
        robot: the robot.
        gait: order, duty and cycle time.
        amplitude: of the coxae [rad].
        lift_angle: of the femora [rad].
        profile: of the coxae in stance.

    Raises:
        GaitError: naming leg, joint, value and limit, and the largest request that works.
    """
    six = require_six_of_three(robot, "ArcWalk")
    gait = six.fitted(gait)
    found = _find_refusal(six, leg_bodies(robot), gait, amplitude, lift_angle, profile)
    if found is not None:
        raise GaitError(*found)


def _slowest(works: Callable[[float], bool], period: float) -> float | None:
    """Return the shortest cycle time with which a walk works [s]; None if none was found."""
    longer = period
    for _ in range(MAX_CYCLE_DOUBLINGS):
        longer *= 2.0
        if works(longer):
            return bisect(works, good=longer, bad=0.5 * longer)
    return None


def _violation(
    six: SixLegs,
    bodies: LegBodies,
    gait: Gait,
    amplitude: float,
    lift_angle: float,
    profile: StanceProfile,
) -> Violation | None:
    """Return why the robot cannot walk, or None if it can."""
    if np.ptp(six.soles) > MAX_FOOT_HEIGHT_SPREAD:
        low, high = (six.legs[int(k)].name for k in (np.argmin(six.soles), np.argmax(six.soles)))
        text = f"the standing posture has foot {high} {np.ptp(six.soles):.4f} m above foot {low}"
        return Violation(PATH, text)
    walk = (six, gait.in_one_second(), amplitude, lift_angle, profile)
    q, v = _joints(*walk)
    found = _out_of_range(six, q)
    if found is not None:
        return found
    posture = posture_violation(six, q, v / gait.cycle_time)
    return _touching(bodies, *walk) if posture is None else posture[0]


@lru_cache(maxsize=CHECKED_WALKS)
def _joints(
    six: SixLegs, gait: Gait, amplitude: float, lift_angle: float, profile: StanceProfile
) -> tuple[Array, Array]:
    """Return joint angles [rad] and rates [rad/s] at the checked times, (6, K, 3) each."""
    end = CHECKED_CYCLES * gait.cycle_time
    path = ArcPath(six, gait, amplitude, lift_angle, profile, end)
    events = np.array([0.0, *path.events(end), end])
    time = knot_times(events, CHECK_SPACING_CYCLES * gait.cycle_time)[0]
    once = path.steady_from + gait.cycle_time  # of the steady part one cycle is enough
    return path.joints(time[(time <= once) | (time >= path.steady_until)])


def _out_of_range(six: SixLegs, q: Array) -> Violation | None:
    """Return the joint that goes farthest beyond its range, joint angles (6, K, 3)."""
    lower, upper = (np.stack([getattr(leg, x) for leg in six.legs]) for x in ("lower", "upper"))
    beyond = np.maximum(lower - q.min(axis=1), q.max(axis=1) - upper)
    if beyond.max() <= ANGLE_TOLERANCE:
        return None
    leg, joint = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    found = six.legs[leg]
    return Violation(
        PATH,
        f"leg {found.name}: joint {found.joints[joint]} would go {beyond[leg, joint]:.4g} rad "
        f"beyond its range {lower[leg, joint]:.4g}..{upper[leg, joint]:.4g} rad",
    )


@lru_cache(maxsize=CHECKED_WALKS)
def _touching(
    bodies: LegBodies,
    six: SixLegs,
    gait: Gait,
    amplitude: float,
    lift_angle: float,
    profile: StanceProfile,
) -> Violation | None:
    """Return which links overlap most in a walk."""
    if not bodies.pairs:
        return None
    q, _ = _joints(six, gait, amplitude, lift_angle, profile)
    angles = six.joint_rows(q, six.posture)
    base = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (len(angles), 1))
    distance, pair = bodies.distances(np.hstack([base, angles]))
    row = int(np.argmin(distance))
    if distance[row] >= -TOUCHING:
        return None
    names = " and ".join(bodies.pairs[pair[row]])
    shapes = f" (shapes: {bodies.assumed})" if bodies.assumed else ""
    return Violation(PATH, f"links {names} overlap by {-distance[row]:.4g} m{shapes}")
