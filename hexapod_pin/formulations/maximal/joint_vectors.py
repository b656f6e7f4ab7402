"""Vectors of the joints that turn with a body, in world axes: what S1 eqs 2-3 are made of."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.rotation import skew

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies

JOINT_POINT, AXIS, NORMAL_A, NORMAL_B = 0, 1, 2, 3
"""Columns of the parent's vectors; the child has its joint point, then a and b."""


@dataclass(frozen=True, eq=False)
class BodyFixedVectors:
    """Vectors fixed to one body of each joint.

    Attributes:
        value: world axes. Shape (nj, 3, k).
        spin: angular velocity w of the body, world axes [rad/s]. Shape (nj, 3).
    """

    value: Array
    spin: Array

    @cached_property
    def _spin_matrix(self) -> Array:
        return skew(self.spin)

    @cached_property
    def rate(self) -> Array:
        """First time derivatives, w x s."""
        return np.asarray(np.matmul(self._spin_matrix, self.value))

    @cached_property
    def second(self) -> Array:
        """Part of the second time derivatives without w', w x (w x s)."""
        return np.asarray(np.matmul(self._spin_matrix, self.rate))


def local_vectors(bodies: Bodies) -> tuple[Array, Array]:
    """Return the vectors in their bodies' axes.

    The parent has s_i, the axis and, for the angle, a and b at zero angle (nj, 3, 4); the child
    has s_j, a_j and b_j (nj, 3, 3).
    """
    a, b = bodies.across
    on_parent = [np.einsum("nij,nj->ni", bodies.attitude, x) for x in (bodies.axis, a, b)]
    return (
        np.stack([bodies.place, *on_parent], axis=-1),
        np.stack([bodies.child_place, a, b], axis=-1),
    )
