"""The kinematics of one leg are solved forward, and inverse in closed form or by Newton steps.

A leg of the yaw-pitch-pitch class is solved in closed form, any other leg of two or three joints
numerically. Angles in rad, lengths in m, base axes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.leg_geometry import (
    BRANCHES,
    POSITION_TOLERANCE,
    LegGeometry,
    YawPitchPitch,
    point_text,
    travel_and_height,
)

if TYPE_CHECKING:
    from hexapod_pin.native import LegSearch
    from hexapod_pin.robot.robot import Robot


@dataclass(frozen=True)
class LegKinematics(LegGeometry):
    """One leg of a robot with its inverse kinematics; attributes as of `LegGeometry`."""

    @staticmethod
    def of(robot: Robot, leg_name: str) -> LegKinematics:
        """Read the geometry of one leg from the robot's model.

        A leg of two joints follows height and travel ahead; see `along`.

        Raises:
            UnknownNameError: if the robot has no leg of that name.
        """
        import pinocchio as pin

        leg = robot.leg(leg_name)
        foot = robot.foot(leg.foot)
        model = robot.model
        data = model.createData()
        pin.computeJointJacobians(model, data, held_configuration(robot))
        ids = [model.getJointId(joint) for joint in leg.joints]
        axes = np.array([data.J[3:, model.idx_vs[i]] for i in ids])
        origins = np.array([data.oMi[i].translation for i in ids])
        p_BF = data.oMi[model.getJointId(foot.joint)].act(np.asarray(foot.offset))
        rows = [robot.joint_index(joint) for joint in leg.joints]
        return LegKinematics(
            name=leg.name,
            joints=leg.joints,
            axes=read_only(axes),
            origins=read_only(origins),
            foot=read_only(p_BF),
            lower=read_only(robot.lower[rows]),
            upper=read_only(robot.upper[rows]),
            posture=read_only(robot.posture[rows]),
            closed_form=YawPitchPitch.from_geometry(axes, origins, p_BF) if len(ids) == 3 else None,
            task=travel_and_height((1.0, 0.0, 0.0)) if len(ids) == 2 else None,
        )

    @cached_property
    def core(self) -> LegSearch:
        """The search of the native core, for a leg without closed form."""
        from hexapod_pin.native import LegSearch

        task = np.eye(3) if self.task is None else self.task
        return LegSearch(
            self.axes, self.origins, self.foot, task, self.lower, self.upper, POSITION_TOLERANCE
        )

    def along(self, direction: ArrayLike) -> LegKinematics:
        """Return the leg with its foot travelling along a horizontal direction, base axes (3,).

        A leg of three joints follows any path and is returned as it is.
        """
        if self.task is None:
            return self
        return replace(self, task=travel_and_height(direction))

    def excess(self, p_BF: ArrayLike) -> Array:
        """Return how far targets lie outside the leg's reach, joint limits aside [m].

        Args:
            p_BF: targets in the base frame [m]. Shape (..., 3).

        Returns:
            0 for a target that some posture reaches. Shape (...).
        """
        p = np.asarray(p_BF, dtype=float)
        flat = p.reshape(-1, 3)
        outside = (
            distance_missed(self, flat)
            if self.closed_form is None
            else distance_outside(self.closed_form, flat)
        )
        return outside.reshape(p.shape[:-1])

    def branches(self, p_BF: ArrayLike) -> Array:
        """Return every closed-form solution for one target, joint limits aside.

        Args:
            p_BF: target in the base frame [m]. Shape (3,).

        Returns:
            Joint angles in (-pi, pi] [rad]: knee up, knee down, then the same two folded over the
            yaw axis; solutions that do not exist are left out. Shape (2 or 4, 3).

        Raises:
            ReachError: if the leg is not of the closed-form class, none reaches, or the target is
                on the yaw axis.
        """
        if self.closed_form is None:
            raise ReachError(self.name, "has no closed form: use inverse().")
        return all_branches(self, self.closed_form, np.asarray(p_BF, dtype=float).reshape(3))

    def inverse(
        self, p_BF: ArrayLike, *, near: ArrayLike | None = None, limits: bool = True
    ) -> Array:
        """Return joint angles that put the foot on a target, or along a path of targets.

        The first target takes the solution nearest to `near` (one inside the joint limits before
        one outside); the following ones stay on that branch and continuous, so no angle jumps.
        Nothing is clamped.

        Args:
            p_BF: targets in the base frame [m]. Shape (3,) or (N, 3).
            near: reference joint angles [rad], the standing posture if None. Shape (J,).
            limits: refuse angles outside the joint limits.

        Returns:
            Joint angles [rad]. Shape (J,) or (N, J). With two joints only height and travel of
            the targets are followed.

        Raises:
            ReachError: if a target is outside the reach or on the yaw axis, or needs a joint
                outside its limits; with the excess.
        """
        p = np.asarray(p_BF, dtype=float)
        targets = p.reshape(-1, 3)
        if not np.isfinite(targets).all():
            raise ReachError(self.name, "a foot target is not finite.")
        reference = self.posture if near is None else np.asarray(near, dtype=float)
        if self.closed_form is None:
            q = follow_search(self, targets, reference, limits=limits)
        else:
            q = follow_branch(self, self.closed_form, targets, reference, limits=limits)
        if limits:
            self.check_limits(q)
        return q.reshape(*p.shape[:-1], len(self.joints))

    def inverse_each(self, p_BF: Array, near: Array) -> Array:
        """Return joint angles of targets that have nothing to do with each other.

        Args:
            p_BF: targets in the base frame [m]. Shape (N, 3).
            near: reference joint angles of each [rad]. Shape (N, J).

        Returns:
            Joint angles inside the joint limits [rad]. Shape (N, J).

        Raises:
            ReachError: as of `inverse`, for the first target that cannot be reached.
        """
        if self.closed_form is not None or not np.isfinite(p_BF).all():
            pairs = zip(p_BF, near, strict=True)
            return np.stack([self.inverse(target, near=start) for target, start in pairs])
        q = _found(self, p_BF, self.core.each(p_BF, near, True))
        self.check_limits(q)
        return q


def held_configuration(robot: Robot) -> Array:
    """Return the model's zero configuration with held joints at their places. Shape (7 + n,)."""
    q = np.zeros(7 + len(robot.joint_names))
    q[6] = 1.0
    for name, place in robot.held.items():
        q[7 + robot.joint_index(name)] = place
    return q


# Inverse kinematics of a yaw-pitch-pitch leg along a path: branch, continuity, reach errors.

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


# Inverse kinematics of a leg of any shape, by Newton steps and a search in the core.


def follow_search(leg: LegKinematics, targets: Array, near: Array, *, limits: bool) -> Array:
    """Return the angles along a path, starting near a reference.

    Args:
        leg: the leg.
        targets: foot targets in the base frame [m]. Shape (N, 3).
        near: reference joint angles [rad]. Shape (J,).
        limits: search inside the joint limits only.

    Returns:
        Joint angles [rad]. Shape (N, J).

    Raises:
        ReachError: no solution was found for a target; with its distance.
    """
    return _found(leg, targets, leg.core.follow(targets, near, limits))


def distance_missed(leg: LegKinematics, targets: Array) -> Array:
    """Return how far targets (N, 3) lie outside the reach, 0 inside [m]. Shape (N,)."""
    misses = leg.core.distances(targets, leg.posture)
    return np.where(misses <= POSITION_TOLERANCE, 0.0, misses)


def _found(leg: LegGeometry, targets: Array, result: tuple[Array, int, float]) -> Array:
    """Return the angles that the core has found for targets (N, 3) [m]. Shape (N, J).

    Raises:
        ReachError: it has found none for a target.
    """
    q, missed, distance = result
    if missed < 0:
        return q
    raise ReachError(
        leg.name,
        f"foot target {point_text(targets[missed])} m lies {distance:.4g} m outside the reach or "
        "the joint limits (numerical search from the nearest known posture).",
        distance,
    )
