"""Vectors of the joints that turn with a body, in world axes: what eqs 2-3 are made of."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.rotation import skew

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies

PLACE, AXIS, A, B = 0, 1, 2, 3  # columns on the parent; on the child PLACE, then a and b


@dataclass(frozen=True, eq=False)
class Carried:
    """Vectors fixed to one body of each joint.

    Attributes:
        value: (nj, 3, k) world axes.
        spin: (nj, 3) angular velocity w of the body, world axes [rad/s].
    """

    value: Array
    spin: Array

    @cached_property
    def _turning(self) -> Array:
        return skew(self.spin)

    @cached_property
    def rate(self) -> Array:
        """First time derivatives, w x s."""
        return np.asarray(np.matmul(self._turning, self.value))

    @cached_property
    def second(self) -> Array:
        """Part of the second time derivatives without w', w x (w x s)."""
        return np.asarray(np.matmul(self._turning, self.rate))


def local_vectors(bodies: Bodies) -> tuple[Array, Array]:
    """Return the vectors in their bodies' axes.

    The parent carries s_i, the axis and, for the angle, a and b at zero angle (nj, 3, 4); the
    child carries s_j, a_j and b_j (nj, 3, 3).
    """
    a, b = bodies.across
    on_parent = [np.einsum("nij,nj->ni", bodies.attitude, x) for x in (bodies.axis, a, b)]
    return (
        np.stack([bodies.place, *on_parent], axis=-1),
        np.stack([bodies.child_place, a, b], axis=-1),
    )
