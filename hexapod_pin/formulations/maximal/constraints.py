"""A revolute joint as five constraints between two bodies (S1 eqs 2-3).

    Phi = [r_j + s_j - r_i - s_i;  d_i . a_j;  d_i . b_j],   Phi' = D v,   Phi'' = D v' - gamma

Body i carries the joint, body j is carried; s_i, s_j lead from the centres of mass to the joint,
d_i is the unit axis on body i, a_j and b_j are unit vectors across it on body j. All unit vectors:
rows 1-3 are in m, rows 4-5 in rad. S1 prints gamma's first row with s where it is s': the dots are
restored here, d/dt s = w x s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.joint_vectors import AXIS, PLACE, Carried
from hexapod_pin.formulations.maximal.rotation import skew

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.motion import BodyState

    Indices = NDArray[np.intp]

ROWS = 5  # of one joint


@dataclass(frozen=True, eq=False)
class Constraints:
    """All joints at one state.

    Attributes:
        violation: Phi (nj, 5) [m, m, m, rad, rad].
        rate: Phi' (nj, 5) [m/s, rad/s].
        on_parent: (nj, 5, 6) columns of D that belong to body i.
        on_child: (nj, 5, 6) columns of D that belong to body j.
        gamma: (nj, 5) [m/s^2, rad/s^2].
    """

    violation: Array
    rate: Array
    on_parent: Array
    on_child: Array
    gamma: Array


def constraints(parent: Indices, state: BodyState, i: Carried, j: Carried) -> Constraints:
    """Return Phi, Phi', D and gamma of all joints."""
    position, velocity = state.position, state.velocity
    tilt = np.matmul(i.value[:, None, :, AXIS], j.value[:, :, 1:])[:, 0]
    gap = position[1:] + j.value[:, :, PLACE] - position[parent] - i.value[:, :, PLACE]
    on_parent, on_child = jacobians(i, j)
    rate = np.matmul(on_child, velocity[1:, :, None]) + np.matmul(
        on_parent, velocity[parent][:, :, None]
    )
    gamma = np.concatenate([gamma_of_place(i, j), gamma_of_axis(i, j)], axis=1)
    return Constraints(
        np.concatenate([gap, tilt], axis=1), rate[:, :, 0], on_parent, on_child, gamma
    )


def jacobians(i: Carried, j: Carried) -> tuple[Array, Array]:
    """Return D's columns of the parents and of the children (S1 eq. 2)."""
    on_parent, on_child = np.zeros((2, len(i.value), ROWS, 6))
    on_child[:, :3, :3] = np.eye(3)
    on_child[:, :3, 3:] = -skew(j.value[:, :, PLACE])
    on_parent[:, :3, :3] = -np.eye(3)
    on_parent[:, :3, 3:] = skew(i.value[:, :, PLACE])
    across = np.matmul(skew(i.value[:, :, AXIS]), j.value[:, :, 1:])  # d x a, d x b
    on_parent[:, 3:, 3:] = across.transpose(0, 2, 1)
    on_child[:, 3:, 3:] = -on_parent[:, 3:, 3:]
    return on_parent, on_child


def gamma_of_place(i: Carried, j: Carried) -> Array:
    """Return row 1 of gamma (nj, 3): -(s_i')~ w_i + (s_j')~ w_j (S1 eq. 3, dots restored)."""
    return np.asarray(i.second[:, :, PLACE] - j.second[:, :, PLACE])


def gamma_of_axis(i: Carried, j: Carried) -> Array:
    """Return rows 2-3 of gamma (nj, 2): -(d'' . a + 2 d' . a' + d . a''), without w' (S1 eq. 3)."""
    left = np.concatenate(
        [i.second[:, None, :, AXIS], 2.0 * i.rate[:, None, :, AXIS], i.value[:, None, :, AXIS]],
        axis=2,
    )
    right = np.concatenate([j.value[:, :, 1:], j.rate[:, :, 1:], j.second[:, :, 1:]], axis=1)
    return np.asarray(-np.matmul(left, right)[:, 0])
