"""Rotor against load: reflected inertia, inertia ratio, and the gear ratio of least RMS torque.

tau_motor,rms^2 (N) = A / N^2 + 2 B + C N^2 with A the mean of the squared load torque and C the
mean of (J_rotor acceleration)^2 is least at N* = (A / C)^(1/4), whatever B: of a pure inertia
sqrt(J_load / J_rotor), the matched inertia (Pasch & Seering 1984). Losses of the gear left out.
"""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.sizing.joint_demand import JointDemand
from hexapod_pin.results.sizing.motors import Motors


def gear_numbers(demand: JointDemand, motors: Motors) -> dict[str, Array]:
    """Return inertias and gear ratios by their names in `MotorUse`; NaN where unknown."""
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = motors.ratio * motors.derating.voltage * motors.no_load / demand.peak_speed
        best = optimal_ratio(
            demand.rms_with_armature(0.0), motors.armature / motors.ratio**2,
            demand.acceleration_rms,
        )  # fmt: skip
        ratio = demand.load_inertia / motors.armature
    return {
        "reflected_inertia": motors.armature,
        "inertia_ratio": _finite(ratio),
        "optimal_ratio": _finite(np.minimum(best, limit)),
        "ratio_limit": _finite(limit),
        "rms_with_rotor": demand.rms_with_armature(motors.armature),
    }


def optimal_ratio(load_rms: Array, rotor_inertia: Array, acceleration_rms: Array) -> Array:
    """Return the gear ratio N* = (A / C)^(1/4) at which the motor's RMS torque is least [-].

    Args:
        load_rms: root of A, RMS torque at the joint without the rotor's share [N m].
        rotor_inertia: of rotor and gear at the motor's shaft [kg m^2].
        acceleration_rms: of the joint [rad/s^2]; root of C is its product with the inertia.
    """
    return np.asarray(np.sqrt(load_rms / (rotor_inertia * acceleration_rms)))


def _finite(values: Array) -> Array:
    """Return NaN for what no motion or no rotor makes infinite."""
    return np.where(np.isfinite(values), values, np.nan)
