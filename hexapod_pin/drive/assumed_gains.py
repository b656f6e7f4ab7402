"""Servo gains where none are given: from the effort where that is plausible, else from weight."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.robot.leg_length import leg_length
from hexapod_pin.robot.once_per_robot import once_per_robot
from hexapod_pin.robot.standing_torque import STANDARD_GRAVITY, SUPPORT, standing_torque

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

FULL_EFFORT_ERROR = 0.025
"""Joint error of full effort [rad] (*assumed*): a hobby servo's 1.4 degrees."""

EFFORT_TIME = 0.02
"""kd / kp of gains from the effort [s] (*assumed*)."""

PLAUSIBLE = (1.0, 20.0)
"""Effort over what standing takes, from which to which it is believed (*assumed*). Below, standing
saturates the drives; above, gains from it are more than a twentieth of a degree can show."""

SAG = 0.01
"""By how much a joint gives way under the load of standing [rad]; sliding joints by this times the
length of a leg (*assumed*)."""

LEAST_ARM = 0.25
"""Lever arm of a third of the weight over the length of a leg, at least: legs that stand upright
carry no torque, but do as soon as they walk (*assumed*)."""

LARGEST_SHARE = 0.5
"""Part of the weight on the middle leg of a standing tripod [-]."""


@dataclass(frozen=True)
class AssumedGains:
    """Gains with the rule that they follow.

    Attributes:
        kp: stiffness [N m/rad]; by joint name where some joints slide [N/m].
        kd: damping [N m s/rad, N s/m].
        effort: what the joints are taken to be able to give [N m].
        rule: where gains do not follow the effort, what they follow and why; else None.
    """

    kp: float | dict[str, float]
    kd: float | dict[str, float]
    effort: float
    rule: str | None


@once_per_robot
def assumed_gains(robot: Robot) -> AssumedGains:
    """Return *assumed* gains for the joints of a robot.

    Turning joints: stiffness is the largest effort over 0.025 rad, damping that times 0.02 s, where
    the effort is 1 to 20 times the load of standing. That load is the largest static torque on the
    fewest feet (`standing_torque`), and no less than a third of the weight at a quarter of a leg's
    length. Otherwise stiffness is such that the load turns a joint by 0.01 rad, and damping is
    critical for half of the mass at the arm where its weight makes the load: 2 sqrt(kp I), with
    I = m r^2, so that kd / kp = 2 sqrt(0.01 r / g).

    Sliding joints: the same with 0.01 of a leg's length for 0.01 rad, r being that length, and
    their static force, no less than a third of the weight.
    """
    slides = ~robot.turning
    effort = float(robot.effort[~slides].max()) if (~slides).any() else 0.0
    arm, weight = leg_length(robot), STANDARD_GRAVITY * robot.total_mass
    load = _load(robot, ~slides, LEAST_ARM * arm * weight / SUPPORT)
    kp: float = effort / FULL_EFFORT_ERROR
    kd, rule = kp * EFFORT_TIME, None
    if load > 0.0 and not PLAUSIBLE[0] * load <= effort <= PLAUSIBLE[1] * load:
        kp = load / SAG
        kd = kp * settling_time(load / (LARGEST_SHARE * weight))
        rule = (
            f"from weight and leg length: the load of standing, {load:.3g} N m, turns a joint by "
            f"{SAG:g} rad; critically damped. Not from the effort of {effort:g} N m, which is "
            f"{effort / load:.2g} times that load"
        )
        effort = kp * FULL_EFFORT_ERROR
    if not slides.any():
        return AssumedGains(kp, kd, effort, rule)
    force = _load(robot, slides, weight / SUPPORT)
    spring = force / (SAG * arm)
    stiffness = np.where(slides, spring, kp).tolist()
    damping = np.where(slides, spring * settling_time(arm), kd).tolist()
    text = f"sliding joints give way by {1e3 * SAG * arm:.2g} mm under {force:.3g} N"
    names, whole = robot.joint_names, text if rule is None else f"{rule}; {text}"
    by_name = dict(zip(names, stiffness, strict=True)), dict(zip(names, damping, strict=True))
    return AssumedGains(*by_name, effort=effort, rule=whole)


def settling_time(arm: float) -> float:
    """Return kd / kp of a critically damped joint whose load at an arm [m] sags by SAG [s]."""
    return 2.0 * math.sqrt(SAG * arm / STANDARD_GRAVITY)


def _load(robot: Robot, joints: NDArray[np.bool_], least: float) -> float:
    """Return the largest static load of some joints, at least `least`; 0 where none is known."""
    torque: Array = standing_torque(robot)[joints]
    if len(robot.feet) < SUPPORT or not torque.size:
        return 0.0
    return max(float(torque.max()), least)
