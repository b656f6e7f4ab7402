"""A revolute joint as five constraints between two bodies (S1 eqs 2-3).

    Phi = [r_j + s_j - r_i - s_i;  d_i . a_j;  d_i . b_j],   Phi' = D v,   Phi'' = D v' - gamma

Body i is the parent, body j the child; s_i, s_j lead from the centres of mass to the joint, d_i is
the unit axis on body i, a_j and b_j are unit vectors across it on body j. All unit vectors: rows
1-3 are in m, rows 4-5 in rad. S1 prints gamma's first row with s where it is s': the dots are
restored here, d/dt s = w x s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.joint_vectors import AXIS, JOINT_POINT, BodyFixedVectors
from hexapod_pin.formulations.maximal.rotation import skew

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.kinematics import BodyKinematics
    from hexapod_pin.formulations.maximal.root_constraint import RootEquations
    from hexapod_pin.formulations.maximal.state import MaximalState

ROWS_PER_JOINT = 5


@dataclass(frozen=True, eq=False)
class ConstraintEquations:
    """All constraints at one state.

    Attributes:
        violation: Phi of the joints [m, m, m, rad, rad]. Shape (nj, 5).
        rate: Phi' [m/s, rad/s]. Shape (nj, 5).
        on_parent: columns of D that belong to body i. Shape (nj, 5, 6).
        on_child: columns of D that belong to body j. Shape (nj, 5, 6).
        gamma: [m/s^2, rad/s^2]. Shape (nj, 5).
        root: the constraints between root and world.
    """

    violation: Array
    rate: Array
    on_parent: Array
    on_child: Array
    gamma: Array
    root: RootEquations

    @property
    def largest_violation(self) -> float:
        """Largest |Phi| of joints and root [m, rad]."""
        parts = (self.violation, self.root.violation)
        return max(float(np.abs(part).max(initial=0.0)) for part in parts)


def joint_constraints(
    parent: NDArray[np.intp], state: MaximalState, at: BodyKinematics, root: RootEquations
) -> ConstraintEquations:
    """Return Phi, Phi', D and gamma of all joints, beside those of the root."""
    position, velocity, i, j = state.position, state.velocity, at.on_parent, at.on_child
    tilt = np.matmul(i.value[:, None, :, AXIS], j.value[:, :, 1:])[:, 0]
    gap = position[1:] + j.value[:, :, JOINT_POINT] - position[parent] - i.value[:, :, JOINT_POINT]
    on_parent, on_child = jacobians(i, j)
    rate = np.matmul(on_child, velocity[1:, :, None])
    rate = rate + np.matmul(on_parent, velocity[parent][:, :, None])
    gamma = np.concatenate([gamma_row_1(i, j), gamma_rows_2_3(i, j)], axis=1)
    violation = np.concatenate([gap, tilt], axis=1)
    return ConstraintEquations(violation, rate[:, :, 0], on_parent, on_child, gamma, root)


def jacobians(i: BodyFixedVectors, j: BodyFixedVectors) -> tuple[Array, Array]:
    """Return D's columns of the parents and of the children (S1 eq. 2)."""
    on_parent, on_child = np.zeros((2, len(i.value), ROWS_PER_JOINT, 6))
    on_child[:, :3, :3] = np.eye(3)
    on_child[:, :3, 3:] = -skew(j.value[:, :, JOINT_POINT])
    on_parent[:, :3, :3] = -np.eye(3)
    on_parent[:, :3, 3:] = skew(i.value[:, :, JOINT_POINT])
    across = np.matmul(skew(i.value[:, :, AXIS]), j.value[:, :, 1:])  # d x a, d x b
    on_parent[:, 3:, 3:] = across.transpose(0, 2, 1)
    on_child[:, 3:, 3:] = -on_parent[:, 3:, 3:]
    return on_parent, on_child


def gamma_row_1(i: BodyFixedVectors, j: BodyFixedVectors) -> Array:
    """Return row 1 of gamma (nj, 3): -(s_i')~ w_i + (s_j')~ w_j (S1 eq. 3, dots restored)."""
    return np.asarray(i.second[:, :, JOINT_POINT] - j.second[:, :, JOINT_POINT])


def gamma_rows_2_3(i: BodyFixedVectors, j: BodyFixedVectors) -> Array:
    """Return rows 2-3 of gamma (nj, 2): -(d'' . a + 2 d' . a' + d . a''), without w' (S1 eq. 3)."""
    axis = [i.second[:, None, :, AXIS], 2.0 * i.rate[:, None, :, AXIS], i.value[:, None, :, AXIS]]
    normals = [j.value[:, :, 1:], j.rate[:, :, 1:], j.second[:, :, 1:]]
    found = np.matmul(np.concatenate(axis, axis=2), np.concatenate(normals, axis=1))
    return np.asarray(-found[:, 0])
