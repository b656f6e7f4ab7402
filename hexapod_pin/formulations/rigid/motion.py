"""S2 appendix eqs. 1-4: a robot whose grounded feet stick to rigid ground.

    M a + h = S^T tau + J^T lambda      (1), (2)
    J a + J' v = 0                      (3)
    [M  J^T; J  0] [a; -lambda] = [S^T tau - h; -J' v]    (4), as printed

lambda are the ground forces on the feet. Where the rows of J depend on each other the motion is
still unique, but lambda is not: the share of smallest norm is given and marked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.rigid.contact_set import Grip
from hexapod_pin.formulations.rigid.kkt import Ranked, solve_ranked
from hexapod_pin.formulations.rigid.model import RigidModel, Terms
from hexapod_pin.formulations.rigid.sticking import FootCheck, check_sticking

BASE = slice(0, 6)
JOINTS = slice(6, None)


@dataclass(frozen=True)
class RigidMotion:
    """What rigid contact makes of one state.

    Attributes:
        acceleration: of the base (body axes) and the joints [m/s^2, rad/s^2]. Shape (nv,).
        force: of the ground on all feet, world axes [N]. Shape (F, 3).
        torque: of the servos [N m]. Shape (n,).
        unique: which force components are determined. Shape (F, 3).
        rank: of the 3k rows of the k grounded feet.
        residual: acceleration left at the contact points, row by row [m/s^2]. Shape (3k,).
        checks: the sticking assumption, foot by foot.
        split: how forces that are not unique were chosen.
    """

    acceleration: Array
    force: Array
    torque: Array
    unique: NDArray[np.bool_]
    rank: int
    residual: Array
    checks: tuple[FootCheck, ...]
    split: str = "minimum norm"

    @property
    def sticks(self) -> bool:
        """Whether every grounded foot could stick."""
        return all(check.holds for check in self.checks)


def rigid_motion(
    model: RigidModel, q: Array, v: Array, torque: ArrayLike, feet: Sequence[int]
) -> RigidMotion:
    """Return accelerations and ground forces under given servo torques, eqs. 1-4.

    Args:
        model: robot and ground.
        q: configuration. Shape (nq,).
        v: velocity. Shape (nv,).
        torque: servo torques [N m]. Shape (n,).
        feet: indices of the grounded feet.

    Raises:
        ParameterError: the torques do not fit the joints, or a foot is named twice.
    """
    return motion_under(model, model.terms(q, v), torque, Grip(tuple(feet)))


def motion_under(model: RigidModel, terms: Terms, torque: ArrayLike, grip: Grip) -> RigidMotion:
    """Return the same from terms at hand, for feet that stick and feet that slide."""
    tau = _torques(model, torque)
    rows, drift = terms.held(grip, model.normal)
    right = -terms.bias
    right[JOINTS] += tau
    found = solve_ranked(terms.mass, right, rows, -drift)
    return _motion(model, found, found.x, tau, grip)


def rigid_gait(
    model: RigidModel, q: Array, v: Array, joint_acceleration: ArrayLike, feet: Sequence[int]
) -> RigidMotion:
    """Return base acceleration, ground forces and torques of joints that follow a plan.

    The base has six accelerations and k feet 3k rows: with more than two feet the rows must agree
    (a plan whose footholds stand still), else they are met in the least-squares sense and
    `residual` is what is left; and the 3k forces are not unique.

    Args:
        model: robot and ground.
        q: configuration. Shape (nq,).
        v: velocity. Shape (nv,).
        joint_acceleration: of the plan [rad/s^2]. Shape (n,).
        feet: indices of the grounded feet.

    Raises:
        ParameterError: the accelerations do not fit the joints, or a foot is named twice.
    """
    grip, terms = Grip(tuple(feet)), model.terms(q, v)
    joints = _torques(model, joint_acceleration)
    rows, drift = terms.held(grip, model.normal)
    right = -terms.bias[BASE] - terms.mass[BASE, JOINTS] @ joints
    target = -drift - rows[:, JOINTS] @ joints
    found = solve_ranked(terms.mass[BASE, BASE], right, rows[:, BASE], target)
    acceleration = np.concatenate([found.x, joints])
    tau = terms.mass[JOINTS] @ acceleration + terms.bias[JOINTS] - rows[:, JOINTS].T @ found.f
    return _motion(model, found, acceleration, tau, grip)


def _motion(
    model: RigidModel, found: Ranked, acceleration: Array, tau: Array, grip: Grip
) -> RigidMotion:
    count = len(model.robot.feet)
    force = grip.spread(found.f, model.normal, count)
    unique = grip.spread_flags(found.unique, count)
    checks = check_sticking(model, grip.feet, force, unique)
    return RigidMotion(acceleration, force, tau, unique, found.rank, found.residual, checks)


def _torques(model: RigidModel, values: ArrayLike) -> Array:
    joints = np.asarray(values, dtype=float)
    if joints.shape != (model.model.nv - 6,):
        raise ParameterError("joint values", joints.shape, f"of shape ({model.model.nv - 6},)")
    return joints
