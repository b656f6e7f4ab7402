"""Kinematics of one leg: foot position, Jacobian, and joint angles for a foot position.

A leg of the yaw-pitch-pitch class is solved in closed form, any other leg of two or three joints
numerically. Angles in rad, lengths in m, base axes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.closed_form_inverse import all_branches, distance_outside, follow_branch
from hexapod_pin.robot.leg_geometry import LegGeometry, travel_and_height
from hexapod_pin.robot.numerical_inverse import distance_missed, follow_search
from hexapod_pin.robot.yaw_pitch_pitch import YawPitchPitch

if TYPE_CHECKING:
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
                outside its limits; it says by how much.
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


def held_configuration(robot: Robot) -> Array:
    """Return the model's zero configuration with held joints at their places. Shape (7 + n,)."""
    q = np.zeros(7 + len(robot.joint_names))
    q[6] = 1.0
    for name, place in robot.held.items():
        q[7 + robot.joint_index(name)] = place
    return q
