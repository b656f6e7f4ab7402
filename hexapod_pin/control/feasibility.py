"""Can this robot walk this gait, and if not, what is the largest request it can?

One walk is checked as a whole: start, steady cycles and stop, every foot target on a fine grid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.errors import GaitError, ReachError
from hexapod_pin.robot.leg_kinematics import LegKinematics

CYCLES = 7  # of the checked walk: 2 to start, 1 or more steady, the rest to stop
SAMPLES_PER_CYCLE = 300
SINGULAR = 0.02
"""Smallest normalised Jacobian determinant a plan may pass (*assumed*).

|det J| over the product of the column lengths: with a knee bent by a small angle e it is about
e L2 / (L2 + L3), so this keeps the knee some 2 degrees from straight.
"""
GROUND = 1e-3  # the standing feet may differ in height by this much [m], *assumed*
TINY_STROKE = 1e-6  # a stroke that tests the lift alone: feet that do not travel do not lift [m]
DIGITS = 1e-4  # relative width at which a bisection ends

PATH, RATE, POSTURE = "path", "rate", "posture"


@dataclass(frozen=True)
class Violation:
    """The first reason why a gait cannot be walked.

    Attributes:
        kind: PATH (reach, singularity, joint position), RATE (joint velocity) or POSTURE (the
            robot does not stand on level feet).
        text: names the leg, the joint, the value and the limit.
    """

    kind: str
    text: str


def joint_path(leg: LegKinematics, p_BF: Array, v_BF: Array) -> tuple[Array, Array]:
    """Return joint angles and rates along a foot path (K, 3), starting near the posture.

    Raises:
        ReachError: the path leaves the leg's reach or joint limits.
    """
    q = leg.inverse(p_BF)
    return q, _joint_rates(leg.jacobian(q), v_BF)


def _joint_rates(jacobian: Array, v_BF: Array) -> Array:
    """Return the rates that move the foot at v_BF (K, 3)."""
    rates = np.linalg.solve(jacobian, v_BF[..., None])[..., 0]
    return np.asarray(rates, dtype=np.float64)


def neutral_feet(legs: Sequence[LegKinematics]) -> Array:
    """Return the foot centres of the standing posture in the base frame [m]. Shape (6, 3)."""
    return np.array([leg.forward(leg.posture) for leg in legs])


def violation(
    legs: Sequence[LegKinematics], velocity: Array, soles: Array, gait: Gait
) -> Violation | None:
    """Return why the robot cannot walk this gait, or None if it can.

    Args:
        legs: six legs in gait order.
        velocity: joint velocity limits [rad/s]. Shape (6, 3).
        soles: lowest point of each foot in the standing posture, base frame [m]. Shape (6,).
        gait: the gait to check.
    """
    if np.ptp(soles) > GROUND:
        low, high = legs[int(np.argmin(soles))].name, legs[int(np.argmax(soles))].name
        return Violation(
            POSTURE,
            f"the standing posture has foot {high} {np.ptp(soles):.4f} m above foot {low}; "
            "all six must stand on the same ground",
        )
    path = FootPath(gait, neutral_feet(legs), stop_at=CYCLES * gait.cycle_time)
    time = np.linspace(0.0, CYCLES, CYCLES * SAMPLES_PER_CYCLE + 1) * gait.cycle_time
    p_BF, v_BF = path.positions(time), path.velocities(time)
    too_fast: tuple[float, Violation | None] = (1.0, None)
    for index, leg in enumerate(legs):
        try:
            q = leg.inverse(p_BF[:, index])
        except ReachError as error:
            return Violation(PATH, str(error))
        jacobian = leg.jacobian(q)
        singular = _near_singular(leg, jacobian)
        if singular is not None:
            return singular
        v = _joint_rates(jacobian, v_BF[:, index])
        ratio = np.abs(v) / velocity[index]
        row, joint = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
        if ratio[row, joint] > too_fast[0]:
            text = (
                f"leg {leg.name}: joint {leg.joints[joint]} would turn at "
                f"{abs(v[row, joint]):.4g} rad/s; its limit is {velocity[index, joint]:.4g} rad/s"
            )
            too_fast = (float(ratio[row, joint]), Violation(RATE, text))
    return too_fast[1]


def _near_singular(leg: LegKinematics, jacobian: Array) -> Violation | None:
    """Return a violation if the leg comes too near a singular posture, Jacobians (K, 3, 3)."""
    size = np.prod(np.linalg.norm(jacobian, axis=1), axis=-1)
    share = np.abs(np.linalg.det(jacobian)) / np.maximum(size, np.finfo(float).tiny)
    lowest = float(share.min())
    if lowest >= SINGULAR:
        return None
    return Violation(
        PATH,
        f"leg {leg.name}: the foot path comes too near a singular posture of "
        f"{', '.join(leg.joints)}, knee straight or foot under the yaw axis "
        f"(normalised determinant {lowest:.4f}, at least {SINGULAR:g})",
    )


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
        return works(changed(gait, cycle_time=cycle_time))

    ceiling = gait.cycle_time
    for _ in range(12):
        ceiling *= 2.0
        if slower(ceiling):
            limit = bisect(slower, good=ceiling, bad=ceiling / 2.0)
            text = f"{reason} With the rest unchanged, cycle_time must be at least {limit:.4g} s."
            return GaitError(text, "cycle_time", limit)
    return _refuse_path(reason, works, gait)


def _refuse_path(reason: str, works: Callable[[Gait], bool], gait: Gait) -> GaitError:
    """Name the largest stroke, lift or turn rate, whichever is the culprit."""

    def shorter(stroke: float) -> bool:
        return works(changed(gait, stroke=stroke))

    def lower(lift: float) -> bool:
        return works(changed(gait, lift=lift))

    def straighter(turn_rate: float) -> bool:
        return works(changed(gait, turn_rate=turn_rate))

    least = min(gait.stroke, TINY_STROKE)
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
    """Return the value nearest to `bad` that is known to work, to DIGITS of the interval."""
    width = DIGITS * abs(bad - good)
    while abs(bad - good) > width:
        middle = 0.5 * (good + bad)
        if works(middle):
            good = middle
        else:
            bad = middle
    return good


def changed(gait: Gait, **fields: float) -> Gait:
    """Return the gait with some fields replaced, validated."""
    return Gait(**{**gait.model_dump(), **fields})
