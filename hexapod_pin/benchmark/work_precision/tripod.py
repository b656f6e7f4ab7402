"""The gait of the speed comparison: a smooth tripod, its set-points held for 10 ms each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

PERIOD = 1.0  # [s]
SWING = 0.25  # amplitude of the coxa, and of the lift in femur and tibia [rad]
RAMP = 0.2  # the gait grows from standing within this time [s]
FIRST_TRIPOD = ("lf", "lr", "rm")


def tripod_setpoints(robot: Robot, time: Array) -> Array:
    """Return the joint angles of the gait at some times, *assumed* for the comparison.

    The coxa swings by r s 0.25 sin(a) (s = 1 left, -1 right), femur and tibia lift by
    -+0.25 r max(0, cos a)^3 from the robot's posture; a = 2 pi t/T, and pi more for the second
    tripod; r = x^2 (3 - 2 x) with x = t/0.2 s up to 1.

    Args:
        robot: six legs of three joints.
        time: (K,) times [s].

    Returns:
        Angles in `joint_names` order [rad]. Shape (K, n).
    """
    q = np.tile(robot.posture, (len(time), 1))
    x = np.clip(time / RAMP, 0.0, 1.0)
    growth = x * x * (3.0 - 2.0 * x)
    for leg in robot.legs:
        coxa, femur, tibia = (robot.joint_index(joint) for joint in leg.joints)
        angle = 2.0 * np.pi * time / PERIOD + (0.0 if leg.name in FIRST_TRIPOD else np.pi)
        side = 1.0 if leg.name.startswith("l") else -1.0
        lift = -SWING * growth * np.maximum(0.0, np.cos(angle)) ** 3
        q[:, coxa] += side * SWING * growth * np.sin(angle)
        q[:, femur] += lift
        q[:, tibia] -= lift
    return q
