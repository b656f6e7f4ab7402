"""The law of the joint servos in the formulations: PD with a torque limit, in NumPy.

Written apart from the native core, which these formulations are compared with.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array


def servo_torque(
    error: Array, rate_error: Array, *, kp: float | Array, kd: float | Array, limit: Array
) -> Array:
    """Return kp (q_ref - q) + kd (q'_ref - q'), limited [N m].

    Args:
        error: q_ref - q [rad]. Shape (n,).
        rate_error: q'_ref - q' [rad/s]. Shape (n,).
        kp: stiffness [N m/rad], one for all joints or shape (n,).
        kd: damping [N m s/rad], one for all joints or shape (n,).
        limit: largest torques [N m], may be infinite. Shape (n,).
    """
    return np.clip(kp * error + kd * rate_error, -limit, limit)
