"""Coulomb's cone as linear inequalities, and how far a stance is from tipping."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.inverse.stance import StanceLoad, stance_load
from hexapod_pin.formulations.rigid.ground import RigidGround
from hexapod_pin.formulations.rigid.model import RigidModel

FEWEST_SIDES = 3
"""Sides of the coarsest pyramid."""

NO_SLIP_FRICTION = 100.0
"""Coefficient of friction [-] with which nothing slips below `STEEPEST_SLOPE_RAD`."""

STEEPEST_SLOPE_RAD = math.radians(89.0)
"""Where the search for the tipping slope ends [rad]."""


def pyramid(normal: Array, mu: float, sides: int = 8) -> Array:
    """Return rows g with g f >= 0 for every force f in the pyramid inside the cone |f_t| <= mu f_n.

    Args:
        normal: unit normal. Shape (3,).
        mu: coefficient of friction [-].
        sides: of the pyramid; mu = 0 leaves the normal direction alone in the limit.

    Returns:
        Shape (sides + 1, 3); the last row is the normal itself.

    Raises:
        ParameterError: fewer than three sides.
    """
    if sides < FEWEST_SIDES:
        raise ParameterError("sides", sides, f"at least {FEWEST_SIDES}")
    first = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    angle = 2.0 * math.pi * np.arange(sides) / sides
    outward = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    inside = mu * math.cos(math.pi / sides)
    return np.vstack([inside * normal - outward, normal])


def normal_force_margin(load: StanceLoad, sides: int = 8) -> float:
    """Return the force that can be taken off the normal force of every foot at once [N].

    The largest s with all forces less s along the normal still inside their pyramids. Negative: the
    stance tips or slides, some foot would have to be held down. Minus infinity: no forces balance
    the load at all. A linear program (`scipy.optimize.linprog`).
    """
    from scipy.optimize import linprog

    count = len(load.feet)
    faces = pyramid(load.normal, load.mu, sides)
    cone = np.hstack([np.kron(np.eye(count), -faces), np.tile(faces @ load.normal, count)[:, None]])
    balance = np.hstack([load.base_rows.T, np.zeros((6, 1))])
    found = linprog(
        np.append(np.zeros(3 * count), -1.0), A_ub=cone, b_ub=np.zeros(len(cone)),
        A_eq=balance, b_eq=load.wrench, bounds=(None, None), method="highs",
    )  # fmt: skip
    return -float(found.fun) if found.success else -math.inf


def tipping_slope(
    model: RigidModel, q: Array, heading: float, feet: Sequence[int] | None = None
) -> float:
    """Return the slope at which a standing robot tips [rad], rising along `heading` [rad].

    The robot stays on its plane and gravity turns; joints are locked and nothing slips.

    Args:
        model: robot and level ground.
        q: configuration on the level plane. Shape (nq,).
        heading: of the rise, from x to y [rad].
        feet: indices of the grounded feet; None: all.
    """
    from scipy.optimize import brentq

    standing = range(len(model.robot.feet)) if feet is None else feet
    size = float(np.linalg.norm(model.gravity))
    rough = RigidGround(mu=NO_SLIP_FRICTION, normal=model.ground.normal, point=model.ground.point)

    def margin(angle: float) -> float:
        """Return the normal-force margin at a slope [N]."""
        uphill = np.array([math.cos(heading), math.sin(heading), 0.0])
        down = -math.sin(angle) * uphill - [0.0, 0.0, math.cos(angle)]
        tilted = RigidModel(model.robot, ground=rough, gravity=size * down)
        zero = np.zeros(tilted.model.nv)
        return normal_force_margin(stance_load(tilted, q, zero, zero, standing))

    return float(brentq(margin, 0.0, STEEPEST_SLOPE_RAD, xtol=1e-12, rtol=1e-14))
