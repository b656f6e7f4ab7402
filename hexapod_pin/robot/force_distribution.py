"""Foot forces hold a robot with the least joint torque, inside the friction cone.

Statics of a robot on F feet, in the axes of its trunk. The ground pushes on foot i with f_i; the
joints of its leg hold tau_i = g_i - J_i^T f_i, where g_i carries the leg's own weight. The forces
balance a load b that passes through the centre of mass, sum A_i f_i = (b, 0), A_i = [1; r_i x].

Of all such forces those are taken that make

    sum (1 / w_i) [f_i^T H_i f_i / 2] - f_i^T J_i R g_i,    H_i = J_i R J_i^T + eps 1

least. With weights w_i = 1 and eps = 0 this is the sum of R tau^2 / 2. The solution is

    f_i = w_i H_i^-1 (J_i R g_i + A_i^T l)

with one 6 x 6 system for l, whatever the number of feet. A foot's force goes with its weight, so
that weights that are continuous in time give forces that are. Feet on equal servos of stiffness kp
share a load in this way by themselves, R = 1 / kp (Castigliano's theorem).

Everything is computed with NumPy alone, and leading axes (...) stand for any number of instants:
the functions serve as a reference for other implementations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.rotations import crosses, skew

FEWEST_FEET = 3
"""Feet with a weight above 0 that are needed for balance."""

REGULARISATION = 0.02
"""eps over the mean of the traces of J R J^T of all feet, divided by 3 [-] (*assumed*)."""

DAMPING = 1e-10
"""Added to the 6 x 6 system's diagonal, over its mean [-]: feet on one line make it singular. The
balance of feet that surround the centre of mass is kept to about 1e-8 of the load."""


# The weights of feet that take up and give back their loads.


@checked
def load_weights(age: ArrayLike, duty: float, cycle_time: float, transfer: float) -> Array:
    """Return the weight of each foot at its place in its cycle, from 0 to 1.

    A quintic step of 1/2 + t / `transfer`, t the time inside the stance, so that the transfer of a
    load is centred on the planned touch-down and lift-off. In stance the smaller of both steps
    counts, in swing the larger one.

    Args:
        age: time since the planned touch-down over the cycle time, 0 to 1; the stance lasts until
            `duty`. Shape (..., F).
        duty: stance over cycle time, 0 to 1 [-].
        cycle_time: [s].
        transfer: time in which a foot takes up its load [s].

    Returns:
        Shape (..., F).

    Raises:
        ParameterError: a time that is not positive, or a duty that is not between 0 and 1.
    """
    for name, value in (("cycle_time", cycle_time), ("transfer", transfer)):
        if not value > 0.0:
            raise ParameterError(name, value, "above 0 s")
    if not 0.0 < duty < 1.0:
        raise ParameterError("duty", duty, "between 0 and 1")
    part = np.asarray(age, dtype=float)
    stance = part < duty
    since = cycle_time * np.where(stance, part, part - 1.0)
    until = cycle_time * (duty - part)
    down, up = (_quintic_step(0.5 + time / transfer) for time in (since, until))
    found: Array = np.where(stance, np.minimum(down, up), np.maximum(down, up))
    return found


def _quintic_step(x: Array) -> Array:
    """Return 10 x^3 - 15 x^4 + 6 x^5 of x between 0 and 1, and 0 or 1 beyond."""
    s = np.clip(x, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


# The forces.


class FootForces(NamedTuple):
    """Forces of least torque inside the friction cone.

    Attributes:
        force: of the ground on each foot, trunk axes [N]. Shape (..., F, 3).
        share: how much of the way from the vertical split to the least torque they go, 0 to 1; 1
            where the cone does not limit them [-]. Shape (...).
    """

    force: Array
    share: Array


@checked
def holding_forces(
    jacobian: ArrayLike, lever: ArrayLike, own_torque: ArrayLike, weight: ArrayLike,
    load: ArrayLike, cost: ArrayLike, mu: float,
) -> FootForces:  # fmt: skip
    """Return the forces of least torque, moved towards the vertical split into the cone.

    Where the cone limits them, the forces of all feet change at once when a foot outside it gains
    its first weight: by up to 3 % of the weight in gaits of the packaged robots with mu = 0.35.

    Args:
        jacobian: of the contact points, a column per joint [m/rad]. Shape (..., F, 3, J).
        lever: from the centre of mass to the contact points [m]. Shape (..., F, 3).
        own_torque: g_i, which hold the legs' own weight [N m]. Shape (..., F, J).
        weight: w_i of each foot, at least three of them above 0 [-]. Shape (..., F).
        load: b, the sum of all forces: the weight, upwards [N]. Shape (3,) or (..., 3).
        cost: R of each joint, such as 1 / (continuous torque)^2 [1/(N m)^2]. Shape (F, J) or
            (..., F, J).
        mu: largest tangential force over normal force, across and along the load [-].

    Raises:
        ParameterError: fewer than three feet with a weight, or `mu` below 0.
    """
    vertical = vertical_split(lever, weight, load)
    least = least_torque_split(jacobian, lever, own_torque, weight, load, cost)
    share = cone_share(least, vertical, load, mu)
    return FootForces(vertical + share[..., None, None] * (least - vertical), share)


@checked
def least_torque_split(
    jacobian: ArrayLike, lever: ArrayLike, own_torque: ArrayLike, weight: ArrayLike,
    load: ArrayLike, cost: ArrayLike, *, regularisation: float = REGULARISATION,
) -> Array:  # fmt: skip
    """Return the forces of least torque, whatever the friction [N]. Shape (..., F, 3).

    Args:
        jacobian: as of `holding_forces`, like all others.
        lever: [m].
        own_torque: [N m].
        weight: [-].
        load: [N].
        cost: [1/(N m)^2].
        regularisation: eps over the mean of the traces of J R J^T, divided by 3 [-]. It keeps a
            leg near a singular posture from taking any force that costs no torque.

    Raises:
        ParameterError: fewer than three feet with a weight.
    """
    j, r, g, w, b, rate = (
        np.asarray(x, dtype=float) for x in (jacobian, lever, own_torque, weight, load, cost)
    )
    _require_feet(w)
    scaled = j * rate[..., None, :]
    stiffness = scaled @ np.swapaxes(j, -1, -2)
    mean = np.trace(stiffness, axis1=-2, axis2=-1).mean(axis=-1)[..., None, None, None] / 3.0
    inverse = np.linalg.inv(stiffness + regularisation * mean * np.eye(3))
    own = np.einsum("...ij,...j->...i", scaled, g)
    # moments over a length, so that the system's rows have one unit
    length = np.sqrt((r**2).sum(axis=-1).mean(axis=-1))[..., None, None, None]
    wrench = np.concatenate([np.broadcast_to(np.eye(3), stiffness.shape), skew(r) / length], -2)
    eased = w[..., None, None] * (wrench @ inverse)
    system = (eased @ np.swapaxes(wrench, -1, -2)).sum(axis=-3)
    trace = np.trace(system, axis1=-2, axis2=-1)[..., None, None]
    system += DAMPING * trace / 6.0 * np.eye(6)
    wanted = -np.einsum("...fai,...fi->...a", eased, own)
    wanted[..., :3] += b
    multiplier = np.linalg.solve(system, wanted[..., None])[..., 0]
    pull = own + np.einsum("...fai,...a->...fi", wrench, multiplier)
    return np.asarray(w[..., None] * np.einsum("...ij,...j->...i", inverse, pull))


@checked
def vertical_split(lever: ArrayLike, weight: ArrayLike, load: ArrayLike) -> Array:
    """Return forces along the load with the least sum of f_i^2 / w_i [N]. Shape (..., F, 3).

    Feet on one line balance the moments as nearly as they can.

    Args:
        lever: from the centre of mass to the contact points [m]. Shape (..., F, 3).
        weight: w_i of each foot, at least three of them above 0 [-]. Shape (..., F).
        load: the sum of all forces [N]. Shape (3,) or (..., 3).

    Raises:
        ParameterError: fewer than three feet with a weight, or no load.
    """
    r, w = np.asarray(lever, dtype=float), np.asarray(weight, dtype=float)
    _require_feet(w)
    size, along = _along(load)
    up = np.broadcast_to(along[..., None, :], r.shape)
    row = np.concatenate([up, crosses(r, up)], axis=-1)  # wrench of a unit force on each foot
    system = np.einsum("...f,...fa,...fb->...ab", w, row, row)
    wanted = np.concatenate([size * along, np.zeros_like(along)], axis=-1)
    wanted = np.broadcast_to(wanted, (*system.shape[:-2], 6))
    inverse = np.linalg.pinv(system, rcond=DAMPING, hermitian=True)
    multiplier = np.einsum("...ab,...b->...a", inverse, wanted)
    return np.asarray((w * np.einsum("...fa,...a->...f", row, multiplier))[..., None] * up)


@checked
def cone_share(least: ArrayLike, vertical: ArrayLike, load: ArrayLike, mu: float) -> Array:
    """Return the largest s, 0 to 1, with v + s (l - v) inside every foot's friction cone. (...).

    Both sets of forces balance the load, so any point between them does. The cone is about the
    direction of the load; as v has no part across it, one division per foot gives its limit:
    s |l_t| <= mu (v_n + s (l_n - v_n)).

    Args:
        least: l, any forces that balance the load [N]. Shape (..., F, 3).
        vertical: v, along the load [N]. Shape (..., F, 3).
        load: the sum of all forces [N]. Shape (3,) or (..., 3).
        mu: largest tangential over normal force [-].

    Raises:
        ParameterError: `mu` is below 0, or there is no load.
    """
    if not mu >= 0.0:
        raise ParameterError("mu", mu, "at least 0")
    along = _along(load)[1][..., None, :]
    l_n, tangential = _parts(np.asarray(least, dtype=float), along)
    v_n = (np.asarray(vertical, dtype=float) * along).sum(axis=-1)
    beyond = tangential - mu * (l_n - v_n)
    limit = np.where(beyond > 0.0, mu * v_n / np.where(beyond > 0.0, beyond, 1.0), 1.0)
    return np.asarray(np.clip(limit.min(axis=-1), 0.0, 1.0))


@checked
def held_torque(jacobian: ArrayLike, own_torque: ArrayLike, force: ArrayLike) -> Array:
    """Return the joint torques g_i - J_i^T f_i under given forces [N m]. Shape (..., F, J).

    Args:
        jacobian: of the contact points [m/rad]. Shape (..., F, 3, J).
        own_torque: of the legs' own weight [N m]. Shape (..., F, J).
        force: of the ground on each foot [N]. Shape (..., F, 3).
    """
    back = np.einsum("...ij,...i->...j", np.asarray(jacobian, float), np.asarray(force, float))
    return np.asarray(np.asarray(own_torque, dtype=float) - back)


@checked
def force_ratio(force: ArrayLike, load: ArrayLike) -> Array:
    """Return the part of each force across the load over that along it [-]. Shape (..., F).

    0 for a foot without force; infinite for one that pushes across the load alone, or pulls.
    """
    normal, tangential = _parts(np.asarray(force, dtype=float), _along(load)[1][..., None, :])
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(normal > 0.0, tangential / normal, np.inf)
    return np.where((normal == 0.0) & (tangential == 0.0), 0.0, ratio)


def _parts(force: Array, along: Array) -> tuple[Array, Array]:
    """Return the part of forces along a unit vector and the size of the rest [N]. (..., F)."""
    normal = (force * along).sum(axis=-1)
    return normal, np.linalg.norm(force - normal[..., None] * along, axis=-1)


def _along(load: ArrayLike) -> tuple[Array, Array]:
    """Return size (..., 1) [N] and direction (..., 3) of a load."""
    b = np.asarray(load, dtype=float)
    size = np.linalg.norm(b, axis=-1, keepdims=True)
    if not (size > 0.0).all():
        raise ParameterError("load", b, "vectors other than zero [N]")
    return size, b / size


def _require_feet(weight: Array) -> None:
    """Refuse weights with which no robot stands."""
    fewest = int((weight > 0.0).sum(axis=-1).min())
    if fewest < FEWEST_FEET:
        raise ParameterError(
            "weight", fewest, f"above 0 for at least {FEWEST_FEET} feet at every instant",
            "Fewer feet cannot hold a robot at rest.",
        )  # fmt: skip
