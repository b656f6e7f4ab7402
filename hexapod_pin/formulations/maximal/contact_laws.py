"""The contact laws (S1 eqs 4-5 and the others) in NumPy, for many contacts at once.

Written apart from the native core on purpose: this solver shares the numbers, not the code.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact import (
    AdamsCoulomb,
    AdamsImpact,
    BrownMcPhee,
    HuntCrossley,
    KelvinVoigt,
    Restitution,
    SmoothStep,
    TanhCoulomb,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array
    from hexapod_pin.ground.contact import FrictionLaw, NormalLaw, StickSlip

MIN_SLIP_SPEED_M_S = 1e-300
"""Keeps m(s)/s finite at rest [m/s]."""

CONE_LIMIT_SHARE = 1.0 - 1e-9
"""A bristle with this share of its friction limit is on the cone [-]."""


def normal_force(law: NormalLaw, depth: Array, rate: Array, touch_speed: Array) -> Array:
    """Return the normal forces [N], never negative.

    Args:
        law: its parameters.
        depth: penetrations d > 0 [m].
        rate: d' [m/s].
        touch_speed: approach speeds at first touch [m/s]; used by `Restitution` only.

    Raises:
        ParameterError: a law this solver does not know.
    """
    spring = law.stiffness * depth**law.exponent
    if isinstance(law, HuntCrossley):
        force = spring * (1.0 + 1.5 * law.dissipation * rate)
    elif isinstance(law, Restitution):
        force = spring * (1.0 + law.eta * rate / np.maximum(touch_speed, law.speed_floor))
    elif isinstance(law, KelvinVoigt):
        force = spring + law.damping * rate
    elif isinstance(law, AdamsImpact):
        force = spring + law.damping * cubic_step(depth / law.damping_depth) * rate
    else:
        raise ParameterError("contact.normal", type(law).__name__, "a normal law of this package")
    return np.maximum(force, 0.0)


def friction_coefficient(law: FrictionLaw, speed: Array) -> Array:
    """Return m(s) [-] of a law of slip speed s >= 0 [m/s]; S1 eq. 5 for `TanhCoulomb`.

    Raises:
        ParameterError: a law this solver does not know.
    """
    if isinstance(law, TanhCoulomb):
        return np.asarray(law.mu * np.tanh(law.slope * speed))
    if isinstance(law, AdamsCoulomb):
        vs, vd = law.stiction_speed, law.transition_speed
        x = np.minimum(speed / vs, 1.0)
        rise = law.mu_static * 0.5 * x * (3.0 - x * x)  # the STEP from -vs to vs
        fall = (law.mu_dynamic - law.mu_static) * cubic_step((speed - vs) / (vd - vs))
        return np.asarray(rise + fall)
    if isinstance(law, SmoothStep):
        x, drop = speed / law.speed, law.mu_static - law.mu_dynamic
        return np.asarray(law.mu_static * quintic_step(x) - drop * quintic_step((x - 1.0) / 2.0))
    if isinstance(law, BrownMcPhee):
        x, peak = speed / law.speed, law.mu_static - law.mu_dynamic
        return np.asarray(law.mu_dynamic * np.tanh(4.0 * x) + peak * x / (0.25 * x**2 + 0.75) ** 2)
    raise ParameterError("contact.friction", type(law).__name__, "a friction law of this package")


def friction_over_speed(law: FrictionLaw, speed: Array) -> Array:
    """Return m(s)/s [s/m]: friction is this times -N u_t, finite at rest too."""
    s = np.maximum(speed, MIN_SLIP_SPEED_M_S)
    return friction_coefficient(law, s) / s


def bristle_friction(
    law: StickSlip, limit: Array, stretch: Array, slip: Array, normal: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return F = k z + c u_t of a stick-slip spring, cut at the friction limit.

    Args:
        law: its parameters.
        limit: mu N [N]. Shape (C, 1).
        stretch: z [m]. Shape (C, 3).
        slip: u_t [m/s]. Shape (C, 3).
        normal: of the ground. Shape (C, 3).

    Returns:
        Friction against the slip (C, 3) [N], z' = (F - k z)/c (C, 3) [m/s], at the limit (C,).
    """
    trial = law.stiffness * stretch + law.damping * slip
    size = np.sqrt(np.einsum("ij,ij->i", trial, trial))[:, None]
    cut = np.where(size > limit, limit / np.maximum(size, np.finfo(float).tiny), 1.0)
    flat = stretch - np.einsum("ij,ij->i", normal, stretch)[:, None] * normal
    rate = (cut * trial - law.stiffness * flat) / law.damping
    return cut * trial, rate, (size >= limit * CONE_LIMIT_SHARE)[:, 0]


def cubic_step(x: Array) -> Array:
    """ADAMS' STEP from 0 at x = 0 to 1 at x = 1."""
    y = np.clip(x, 0.0, 1.0)
    return np.asarray(y * y * (3.0 - 2.0 * y))


def quintic_step(x: Array) -> Array:
    """Drake's step5 from 0 at x = 0 to 1 at x = 1."""
    y = np.clip(x, 0.0, 1.0)
    return np.asarray(y**3 * (10.0 - y * (15.0 - 6.0 * y)))
