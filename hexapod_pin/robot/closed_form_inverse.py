"""Inverse kinematics of a yaw-pitch-pitch leg along a path: branch, continuity, reach errors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.leg_geometry import POSITION_TOLERANCE, LegGeometry, point_text
from hexapod_pin.robot.yaw_pitch_pitch import BRANCHES, YawPitchPitch

UNLIMITED = np.full(3, -np.inf)
"""Lower joint limits of a leg whose limits do not count [rad]; the upper ones are the opposite."""


def follow_branch(
    leg: LegGeometry, geometry: YawPitchPitch, targets: Array, near: Array, *, limits: bool
) -> Array:
    """Return the angles along a path, on the branch that starts nearest to a reference.

    Args:
        leg: the leg, for its joint limits and names.
        geometry: its closed form.
        targets: foot targets in the base frame [m]. Shape (N, 3).
        near: reference joint angles [rad]. Shape (3,).
        limits: take a first solution inside the joint limits before one outside.

    Returns:
        Joint angles, continuous from target to target [rad]. Shape (N, 3).

    Raises:
        ReachError: a target is outside the reach or on the yaw axis.
    """
    p_HF, radius = geometry.to_hip(targets)
    check_yaw_axis(leg, targets, radius)
    lower, upper = (leg.lower, leg.upper) if limits else (UNLIMITED, -UNLIMITED)
    branch = nearest_branch(geometry, targets[:1], near, lower, upper)
    q, outside = geometry.solve(p_HF, radius, *BRANCHES[int(branch)])
    worst = int(np.argmax(outside))
    if outside[worst] > reach_tolerance(geometry):
        raise _out_of_reach(leg, geometry, targets[worst], float(outside[worst]))
    return continuous(q, near)


def nearest_branch(
    geometry: YawPitchPitch, target: Array, near: Array, lower: Array, upper: Array
) -> NDArray[np.intp]:
    """Return the index in BRANCHES of the solution nearest to a reference.

    A solution inside the reach goes before one outside, then one inside the joint limits before
    one outside, then the smaller of the largest angles to the reference.

    Args:
        geometry: of one leg, or of L stacked legs.
        target: one foot target per leg, base frame [m]. Shape (1, 3) or (L, 1, 3).
        near: reference joint angles [rad]. Shape (3,) or (L, 3), as of the limits.
        lower: lower joint limits [rad].
        upper: upper joint limits [rad].

    Returns:
        Shape () or (L,).
    """
    p_HF, radius = geometry.to_hip(target)
    solved = [geometry.solve(p_HF, radius, *branch) for branch in BRANCHES]
    q = np.stack([angles[..., 0, :] for angles, _ in solved])
    missed = np.stack([(out > reach_tolerance(geometry))[..., 0] for _, out in solved])
    start = near + wrap(q - near)
    beyond = ((start < lower) | (start > upper)).any(axis=-1)
    cost = np.abs(start - near).max(axis=-1) + 2 * np.pi * beyond + 8 * np.pi * missed
    return np.asarray(np.argmin(cost, axis=0))


def all_branches(leg: LegGeometry, geometry: YawPitchPitch, target: Array) -> Array:
    """Return every solution for one target (3,), in the order of BRANCHES. Shape (2 or 4, 3).

    Raises:
        ReachError: none reaches, or the target is on the yaw axis.
    """
    q, outside, radius = geometry.solve_all(target[None])
    check_yaw_axis(leg, target[None], radius)
    exists = outside[0] <= reach_tolerance(geometry)
    if not exists.any():
        raise _out_of_reach(leg, geometry, target, float(outside.min()))
    return wrap(q[0][exists])


def distance_outside(geometry: YawPitchPitch, targets: Array) -> Array:
    """Return how far targets (N, 3) lie outside the reach, 0 inside [m]. Shape (N,)."""
    outside = geometry.solve_all(targets)[1].min(axis=1)
    return np.where(outside <= reach_tolerance(geometry), 0.0, outside)


def reach_tolerance(geometry: YawPitchPitch) -> Array:
    """Return the rounding error of a leg's length: a target this far outside is reached [m].

    Returns:
        A scalar for one leg, shape (L, 1) for stacked legs.
    """
    tolerance: Array = 16 * np.finfo(float).eps * geometry.lengths.sum(axis=-1)
    return tolerance


def check_yaw_axis(leg: LegGeometry, targets: Array, radius: Array) -> None:
    """Refuse targets (N, 3) on the yaw axis, given their distance from it (N,) [m].

    Raises:
        ReachError: naming the nearest.
    """
    worst = int(np.argmin(radius))
    if radius[worst] < POSITION_TOLERANCE:
        raise ReachError(
            leg.name,
            f"foot target {point_text(targets[worst])} m lies on the axis of {leg.joints[0]}, "
            "where its angle is undefined.",
        )


def continuous(q: Array, near: Array) -> Array:
    """Return angles moved by whole turns so that none jumps, starting nearest to a reference.

    Args:
        q: joint angles along a path [rad]. Shape (..., N, 3).
        near: reference for the first [rad]. Shape (..., 3).
    """
    start = near + wrap(q[..., 0, :] - near)
    path = np.concatenate([start[..., None, :], q], axis=-2)
    if np.abs(np.diff(path, axis=-2)).max() < np.pi:
        return q + 0.0  # as `unwrap` adds no turn, also to the sign of a zero
    unwrapped: Array = np.unwrap(path, axis=-2)[..., 1:, :]
    return unwrapped


def wrap(angle: Array) -> Array:
    """Return angles in (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle, 2 * np.pi)


def _out_of_reach(
    leg: LegGeometry, geometry: YawPitchPitch, target: Array, excess: float
) -> ReachError:
    """Return the error with the reach interval."""
    near, far = geometry.reach()
    return ReachError(
        leg.name,
        f"foot target {point_text(target)} m lies {excess:.4g} m outside the reach, which is "
        f"{near:.4f} to {far:.4f} m from the axis of {leg.joints[1]}.",
        excess,
    )
