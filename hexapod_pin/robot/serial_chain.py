"""Forward kinematics and Jacobian of revolute joints in a row, for one leg or stacked legs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array


@dataclass(frozen=True, eq=False)
class JointAxis:
    """One joint at q = 0 in the base frame, of one leg or of L stacked legs.

    Attributes:
        origin: a point on the axis [m]. Shape (3,) or (L, 1, 3).
        row: the unit direction as a row. Shape (1, 3) or (L, 1, 3).
        cross: matrix with v @ cross = direction x v for rows v. Shape (3, 3) or (L, 3, 3).
    """

    origin: Array
    row: Array
    cross: Array

    @staticmethod
    def of(unit: Array, origin: Array) -> JointAxis:
        """Return the axis of one leg's joint from its direction and origin, (3,) each."""
        x, y, z = unit
        cross = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        return JointAxis(origin, unit[None], cross)

    @staticmethod
    def stack(axes: Sequence[JointAxis]) -> JointAxis:
        """Stack the same joint of several legs."""
        return JointAxis(
            np.stack([axis.origin for axis in axes])[:, None],
            np.stack([axis.row for axis in axes]),
            np.stack([axis.cross for axis in axes]),
        )

    def rotate(self, v: Array, cos: Array, sin: Array) -> Array:
        """Rotate vectors (..., 3) by angles given as cosines and sines (..., 1) (Rodrigues)."""
        along = (1.0 - cos) * (v @ np.swapaxes(self.row, -1, -2))
        rotated: Array = cos * v + sin * (v @ self.cross) + along @ self.row
        return rotated

    def turned(self, points: Array, angle: float | Array) -> Array:
        """Return points (..., 3) turned about the axis by angles (...) [rad]."""
        c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
        moved: Array = self.origin + self.rotate(points - self.origin, c, s)
        return moved


@dataclass(frozen=True, eq=False)
class SerialChain:
    """J revolute joints and a foot, of one leg or of L stacked legs.

    Joint angles q have shape (..., J) for one leg and (L, N, J) for stacked legs.

    Attributes:
        joints: from the body outwards. J of them.
        foot: foot centre at q = 0 in the base frame [m]. Shape (3,) or (L, 1, 3).
    """

    joints: tuple[JointAxis, ...]
    foot: Array

    @staticmethod
    def of(axes: Array, origins: Array, foot: Array) -> SerialChain:
        """Return one leg's chain from axes (J, 3) and origins (J, 3), a row per joint."""
        return SerialChain(tuple(map(JointAxis.of, axes, origins)), foot)

    @staticmethod
    def stack(chains: Sequence[SerialChain]) -> SerialChain:
        """Stack the chains of several legs."""
        joints = zip(*(chain.joints for chain in chains), strict=True)
        foot = np.stack([chain.foot for chain in chains])[:, None]
        return SerialChain(tuple(JointAxis.stack(axes) for axes in joints), foot)

    def forward(self, q: Array) -> Array:
        """Return the foot centre in the base frame [m]. Shape (..., 3)."""
        p = np.broadcast_to(self.foot, (*q.shape[:-1], 3))
        cos, sin = np.cos(q), np.sin(q)
        for k in reversed(range(len(self.joints))):
            joint = self.joints[k]
            c, s = cos[..., k, None], sin[..., k, None]
            p = joint.origin + joint.rotate(p - joint.origin, c, s)
        return p

    def axes(self, q: Array) -> Array:
        """Return the joint axes in base axes, a column per joint. Shape (..., 3, J)."""
        cos, sin, shape = np.cos(q), np.sin(q), (*q.shape[:-1], 3)
        columns: list[Array] = []
        for k in reversed(range(len(self.joints) - 1)):
            joint, c, s = self.joints[k], cos[..., k, None], sin[..., k, None]
            outer = self.joints[k + 1].row
            columns.insert(0, np.broadcast_to(outer, shape))
            columns = [joint.rotate(column, c, s) for column in columns]
        columns.insert(0, np.broadcast_to(self.joints[0].row, shape))
        return np.stack(columns, axis=-1)

    def jacobian(self, q: Array) -> Array:
        """Return d foot / d q, a column per joint [m/rad]. Shape (..., 3, J)."""
        return self.forward_and_jacobian(q)[1]

    def forward_and_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Return both, by rotating the foot and the Jacobian's columns from the foot inwards."""
        p = np.broadcast_to(self.foot, (*q.shape[:-1], 3))
        cos, sin = np.cos(q), np.sin(q)
        columns: list[Array] = []
        for k in reversed(range(len(self.joints))):
            joint, c, s = self.joints[k], cos[..., k, None], sin[..., k, None]
            p = joint.origin + joint.rotate(p - joint.origin, c, s)
            columns = [joint.rotate(column, c, s) for column in columns]
            columns.insert(0, (p - joint.origin) @ joint.cross)
        return p, np.stack(columns, axis=-1)


def axis_points(axes: Array, origins: Array, end: Array) -> Array:
    """Return for each axis its point nearest to the next axis' point, for the last to the end [m].

    They are the same wherever along an axis a file puts its joint, and move with their links.

    Args:
        axes: unit directions, from the body outwards. Shape (J, 3).
        origins: a point on each axis [m]. Shape (J, 3).
        end: of the chain [m]. Shape (3,).

    Returns:
        Shape (J, 3).
    """
    points = np.zeros(origins.shape)
    for k in range(len(points) - 1, -1, -1):
        end = points[k] = origins[k] + ((end - origins[k]) @ axes[k]) * axes[k]
    return points
