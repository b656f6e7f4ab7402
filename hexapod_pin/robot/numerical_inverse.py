"""Inverse kinematics of a leg of any shape: Newton steps along a path, search where they fail."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.leg_geometry import POSITION_TOLERANCE, LegGeometry, point_text

MAX_ANGLE_CHANGE = 0.2
"""Neighbouring targets whose Newton solutions differ by more are searched again [rad]."""

NEWTON_STEPS = 12
MAX_NEWTON_STEP = 0.3  # of one joint [rad]
CONVERGED_STEP = 1e-9  # the steps end with a smaller one: the next would be its square [rad]
NEAR_START = 1.0  # a Newton solution within this of its start is taken as the nearest one [rad]
NEWTON_DAMPING = 1e-14  # added to the diagonal of J^T J [m^2]


def follow_search(leg: LegGeometry, targets: Array, near: Array, *, limits: bool) -> Array:
    """Return the angles along a path, starting near a reference.

    Args:
        leg: the leg.
        targets: foot targets in the base frame [m]. Shape (N, 3).
        near: reference joint angles [rad]. Shape (J,).
        limits: search inside the joint limits only.

    Returns:
        Joint angles [rad]. Shape (N, J).

    Raises:
        ReachError: no solution was found for a target.
    """
    q_first = _first(leg, targets[0], near, limits=limits)
    q = _newton(leg, targets, np.tile(q_first, (len(targets), 1)))
    missed = leg.followed(leg.forward(q) - targets)
    found = np.linalg.norm(missed, axis=1) <= POSITION_TOLERANCE
    if found.all() and not _jumps(q).any():
        return q
    suspect = ~found
    suspect[1:] |= _jumps(q)
    for k in range(1, len(targets)):
        if not suspect[k] or (found[k] and not _jumps(q[k - 1 : k + 1])[0]):
            continue
        q[k] = _first(leg, targets[k], q[k - 1], limits=limits)
        suspect[k + 1 : k + 2] = True
    return q


def _jumps(q: Array) -> NDArray[np.bool_]:
    """Tell which angles (N, J) are far from those before. Shape (N - 1,)."""
    return np.asarray((np.abs(np.diff(q, axis=0)) >= MAX_ANGLE_CHANGE).any(axis=1))


def _first(leg: LegGeometry, target: Array, near: Array, *, limits: bool) -> Array:
    """Return the angles for one target (3,): Newton steps, and search where they lead away.

    Raises:
        ReachError: no solution was found.
    """
    q: Array = _newton(leg, target[None], near[None].copy())[0]
    inside = not limits or bool(((q >= leg.lower) & (q <= leg.upper)).all())
    missed = np.linalg.norm(leg.followed(leg.forward(q) - target))
    if inside and missed <= POSITION_TOLERANCE and np.abs(q - near).max() < NEAR_START:
        return q
    q, miss = search(leg, target, near, limits=limits)
    if miss > POSITION_TOLERANCE:
        raise _not_found(leg, target, miss)
    return q


def search(leg: LegGeometry, target: Array, near: Array, *, limits: bool) -> tuple[Array, float]:
    """Return the least-squares solution for one target (3,) from `near` and its distance [m]."""
    from scipy.optimize import least_squares

    bounds: Any = (leg.lower, leg.upper) if limits else (-np.inf, np.inf)
    found = least_squares(
        lambda q: leg.followed(leg.forward(q) - target),
        np.clip(near, *bounds),
        jac=lambda q: leg.followed(leg.jacobian(q).T).T,
        bounds=bounds,
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    return found.x, float(np.linalg.norm(found.fun))


def distance_missed(leg: LegGeometry, targets: Array) -> Array:
    """Return how far targets (N, 3) lie outside the reach, 0 inside [m]. Shape (N,)."""
    misses = np.array([search(leg, target, leg.posture, limits=False)[1] for target in targets])
    return np.where(misses <= POSITION_TOLERANCE, 0.0, misses)


def _newton(leg: LegGeometry, targets: Array, q: Array) -> Array:
    """Take damped Newton steps towards all targets (N, 3) from q (N, J)."""
    for _ in range(NEWTON_STEPS):
        p, jacobian = leg.chain.forward_and_jacobian(q)
        transposed = leg.followed(np.swapaxes(jacobian, -1, -2))
        missed = leg.followed(targets - p)
        normal = transposed @ np.swapaxes(transposed, -1, -2) + NEWTON_DAMPING * np.eye(q.shape[1])
        step = np.linalg.solve(normal, transposed @ missed[..., None])[..., 0]
        q = q + np.clip(step, -MAX_NEWTON_STEP, MAX_NEWTON_STEP)
        if np.abs(step).max() < CONVERGED_STEP:
            break
    return q


def _not_found(leg: LegGeometry, target: Array, miss: float) -> ReachError:
    """Return the error of a search that ended away from its target."""
    return ReachError(
        leg.name,
        f"foot target {point_text(target)} m lies {miss:.4g} m outside the reach or the joint "
        "limits (numerical search from the nearest known posture).",
        miss,
    )
