"""What arcs are made of: the blend of rates, radius and sense of each leg."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.footholds import COINCIDENT
from hexapod_pin.control.six_legs import SixLegs
from hexapod_pin.errors import GaitError

BLEND_SHARE = 0.1
"""Share of a swing in which its rate passes from, or to, that of the stance (*assumed*)."""

MAX_SKEW = 0.02
"""Largest angle between a foot's motion about its yaw axis and straight ahead [rad], *assumed*."""


def blend(s: Array) -> tuple[Array, Array]:
    """Return s (1 - s/b)^2 inside 0..b, b = BLEND_SHARE, and its derivative: 1 at 0, 0 at b."""
    left = 1.0 - np.clip(s, 0.0, BLEND_SHARE) / BLEND_SHARE
    x = BLEND_SHARE * (1.0 - left)
    return x * left**2, left**2 - 2.0 * x * left / BLEND_SHARE


def arc_senses(six: SixLegs) -> tuple[Array, Array]:
    """Return R (6,) [m] and the signs (6, 3) that move feet ahead (joint 1) and up (joint 2).

    Raises:
        GaitError: a leg does not point straight sideways.
    """
    posture = np.array(six.kinematics.posture)[:, None]
    jacobian = six.kinematics.jacobian(posture)[:, 0]
    about_yaw = jacobian[:, :, 0]
    radius = np.linalg.norm(about_yaw, axis=-1)
    skew = np.arccos(np.clip(np.abs(about_yaw[:, 0]) / np.maximum(radius, COINCIDENT), 0.0, 1.0))
    worst = int(np.argmax(skew))
    if skew[worst] > MAX_SKEW:
        leg = six.legs[worst]
        raise GaitError(
            f"leg {leg.name}: about {leg.joints[0]} the standing foot moves "
            f"{np.degrees(skew[worst]):.3g} deg off straight ahead, at most "
            f"{np.degrees(MAX_SKEW):.3g} deg; an arc walk needs legs that point sideways. "
            "KinematicControl walks with legs of any direction.",
            "posture",
            None,
        )
    sense = np.sign(np.stack([about_yaw[:, 0], jacobian[:, 2, 1], np.zeros(6)], axis=-1))
    return radius, sense
