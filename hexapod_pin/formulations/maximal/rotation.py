"""Unit quaternions turn the joint vectors that S1 eqs 2-3 are made of."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies


CROSS_PRODUCT = np.array(
    [[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]],
    dtype=float,
)
"""E with (a @ E).reshape(3, 3) @ b = a x b. Shape (3, 9)."""


def skew(a: Array) -> Array:
    """Return the matrices a~ with a~ b = a x b, (..., 3, 3), of vectors (..., 3)."""
    return np.asarray((a @ CROSS_PRODUCT).reshape(*a.shape[:-1], 3, 3))


def cross(a: Array, b: Array) -> Array:
    """Return a x b, (..., 3)."""
    return np.asarray(np.matmul(skew(a), b[..., None])[..., 0])


def rotations(q: Array) -> Array:
    """Return the rotation matrices 1 + 2 (w v~ + v~ v~)/|q|^2 (n, 3, 3) of (n, 4), body to world.

    A quaternion off unit length gives the rotation of the unit quaternion along it.
    """
    axis, w = skew(q[:, :3]), q[:, 3, None, None]
    size = np.einsum("ij,ij->i", q, q)[:, None, None]
    return np.asarray(np.eye(3) + 2.0 / size * (w * axis + np.matmul(axis, axis)))


def product(p: Array, q: Array) -> Array:
    """Return the products p q (n, 4): q turns first."""
    vector = p[:, 3:] * q[:, :3] + q[:, 3:] * p[:, :3] + cross(p[:, :3], q[:, :3])
    scalar = p[:, 3] * q[:, 3] - np.einsum("ij,ij->i", p[:, :3], q[:, :3])
    return np.column_stack([vector, scalar])


def quaternion_rate(q: Array, spin: Array) -> Array:
    """Return q' = (w, 0) q / 2, (n, 4), of bodies turning at w (n, 3) [rad/s], world axes."""
    return 0.5 * product(np.column_stack([spin, np.zeros(len(spin))]), q)


def turned(q: Array, turn: Array) -> Array:
    """Return quaternions (n, 4) turned by rotation vectors (n, 3) [rad], world axes."""
    from scipy.spatial.transform import Rotation

    return normalised(product(Rotation.from_rotvec(turn).as_quat(), q))


def normalised(q: Array) -> Array:
    """Return quaternions of unit length."""
    return np.asarray(q / np.sqrt(np.einsum("ij,ij->i", q, q))[:, None])


# Vectors of the joints that turn with a body, in world axes: what S1 eqs 2-3 are made of.

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
