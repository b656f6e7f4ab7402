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
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.rigid.constraints import ContactSet
from hexapod_pin.formulations.rigid.kkt import KktSolution, solve_kkt
from hexapod_pin.formulations.rigid.model import EquationTerms, RigidModel
from hexapod_pin.formulations.rigid.sticking import StickingCheck, check_sticking

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import State

BASE = slice(0, 6)
JOINTS = slice(6, None)


@dataclass(frozen=True)
class RigidDerivative:
    """v' and the forces of rigid contact at one state; F feet, k of them grounded, n joints.

    Attributes:
        acceleration: v' of the base (body axes) and the joints [m/s^2, rad/s^2]. Shape (nv,).
        force: lambda, of the ground on all feet, world axes [N]. Shape (F, 3).
        torque: of the servos [N m]. Shape (n,).
        unique: which force components are determined. Shape (F, 3).
        rank: of the 3k rows of the grounded feet.
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
    checks: tuple[StickingCheck, ...]
    split: str = "minimum norm"

    @property
    def sticks(self) -> bool:
        """Whether every grounded foot could stick."""
        return all(check.holds for check in self.checks)


def derivative(
    model: RigidModel, state: State, torque: ArrayLike, feet: Sequence[int]
) -> RigidDerivative:
    """Return accelerations and ground forces under given servo torques, eqs. 1-4.

    Args:
        model: robot and ground.
        state: the state.
        torque: of the servos [N m]. Shape (n,).
        feet: indices of the grounded feet.

    Raises:
        ParameterError: the torques do not fit the joints, or a foot is named twice.
    """
    terms = model.terms(state.q, state.v)
    return constrained_derivative(model, terms, torque, ContactSet(tuple(feet)))


def constrained_derivative(
    model: RigidModel, terms: EquationTerms, torque: ArrayLike, contacts: ContactSet
) -> RigidDerivative:
    """Return the same from terms at hand, for feet that stick and feet that slide."""
    tau = _joint_values(model, torque)
    rows, drift = contacts.equations(terms, model.normal)
    right = -terms.bias
    right[JOINTS] += tau
    found = solve_kkt(terms.mass, right, rows, -drift)
    return _solution(model, found, found.x, tau, contacts)


def prescribed_derivative(
    model: RigidModel, state: State, joint_acceleration: ArrayLike, feet: Sequence[int]
) -> RigidDerivative:
    """Return base acceleration, ground forces and torques where the joints' motion is prescribed.

    The base has six accelerations and k feet 3k rows: with more than two feet the rows must agree
    (footholds that stand still), else they are met in the least-squares sense and `residual` is
    what is left; and the 3k forces are not unique.

    Args:
        model: robot and ground.
        state: the state.
        joint_acceleration: prescribed [rad/s^2]. Shape (n,).
        feet: indices of the grounded feet.

    Raises:
        ParameterError: the accelerations do not fit the joints, or a foot is named twice.
    """
    contacts, terms = ContactSet(tuple(feet)), model.terms(state.q, state.v)
    joints = _joint_values(model, joint_acceleration)
    rows, drift = contacts.equations(terms, model.normal)
    right = -terms.bias[BASE] - terms.mass[BASE, JOINTS] @ joints
    target = -drift - rows[:, JOINTS] @ joints
    found = solve_kkt(terms.mass[BASE, BASE], right, rows[:, BASE], target)
    acceleration = np.concatenate([found.x, joints])
    tau = terms.mass[JOINTS] @ acceleration + terms.bias[JOINTS] - rows[:, JOINTS].T @ found.f
    return _solution(model, found, acceleration, tau, contacts)


def _solution(
    model: RigidModel, found: KktSolution, acceleration: Array, tau: Array, contacts: ContactSet
) -> RigidDerivative:
    count = len(model.robot.feet)
    force = contacts.forces(found.f, model.normal, count)
    unique = contacts.force_flags(found.unique, count)
    checks = check_sticking(model, contacts.feet, force, unique)
    return RigidDerivative(acceleration, force, tau, unique, found.rank, found.residual, checks)


def _joint_values(model: RigidModel, values: ArrayLike) -> Array:
    joints = np.asarray(values, dtype=float)
    if joints.shape != (model.model.nv - 6,):
        raise ParameterError("joint values", joints.shape, f"of shape ({model.model.nv - 6},)")
    return joints
