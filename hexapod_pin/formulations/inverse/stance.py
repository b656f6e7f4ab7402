"""S2 appendix eqs. 1-2 of a stance, as a linear problem in the foot forces f.

    J_b^T f = w                 six equations: the base has the given acceleration
    tau = tau_0 - J_j^T f       the torques that go with f

With k feet f has 3k components: from three feet on it is not unique, and a split chooses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.truncated_svd import pseudo_inverse

UNIQUE_NULL_SPACE_PART = 1e-9
"""A force component with a larger part than this in the null space is not unique [-]."""


@dataclass(frozen=True)
class StanceLoad:
    """The balance of one stance; k feet, n joints.

    Attributes:
        feet: indices of the grounded feet.
        base_rows: J_b, velocity of the contact points per base twist (body axes). Shape (3k, 6).
        joint_rows: J_j, the same per joint rate. Shape (3k, n).
        wrench: w, what the feet must give to the base, body axes [N, N m]. Shape (6,).
        free_torque: tau_0, torques with unloaded feet [N m]. Shape (n,).
        normal: of the ground. Shape (3,).
        mu: coefficient of friction [-].
        effort: largest torques [N m]. Shape (n,).
    """

    feet: tuple[int, ...]
    base_rows: Array
    joint_rows: Array
    wrench: Array
    free_torque: Array
    normal: Array
    mu: float
    effort: Array

    def torque(self, force: Array) -> Array:
        """Return the torques (n,) that go with the foot forces (3k,)."""
        return self.free_torque - self.joint_rows.T @ force

    def imbalance(self, force: Array) -> Array:
        """Return what foot forces (3k,) leave of the base's balance, body axes (6,) [N, N m]."""
        return self.base_rows.T @ force - self.wrench

    @property
    def unique(self) -> NDArray[np.bool_]:
        """Whether the balance alone determines each force component. Shape (3k,)."""
        _, null = pseudo_inverse(self.base_rows.T)
        return np.asarray(np.linalg.norm(null, axis=1) < UNIQUE_NULL_SPACE_PART)


def stance_load(
    model: RigidModel, q: Array, v: Array, acceleration: Array, feet: Sequence[int]
) -> StanceLoad:
    """Return the balance of a robot that moves with this acceleration on these feet.

    Args:
        model: robot and ground.
        q: configuration. Shape (nq,).
        v: velocity. Shape (nv,).
        acceleration: of base (body axes) and joints [m/s^2, rad/s^2]. Shape (nv,).
        feet: indices of the grounded feet.
    """
    needed = model.inverse_dynamics(q, v, acceleration)
    rows = model.positions(q)[1][list(feet)].reshape(-1, len(needed))
    return StanceLoad(
        feet=tuple(feet), base_rows=rows[:, :6], joint_rows=rows[:, 6:], wrench=needed[:6],
        free_torque=needed[6:], normal=model.normal, mu=model.ground.mu,
        effort=np.asarray(model.robot.effort, dtype=float),
    )  # fmt: skip
