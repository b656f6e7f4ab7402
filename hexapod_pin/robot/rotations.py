"""Rotations and cross products: of one body, of rows of bodies, and of many trunks at a time.

Quaternions are x, y, z, w. Roll, pitch and yaw are those of URDF: Rz(yaw) Ry(pitch) Rx(roll).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array

# Of one body: plain numbers, many times as quick as NumPy's functions for stacks.


def rotation(rpy: tuple[float, ...]) -> Array:
    """Return the rotation (3, 3) of roll, pitch and yaw [rad]."""
    return np.array(_from_angles(*map(math.sin, rpy), *map(math.cos, rpy)))


def _from_angles(sr: Any, sp: Any, sy: Any, cr: Any, cp: Any, cy: Any) -> list[list[Any]]:
    """Return Rz(yaw) Ry(pitch) Rx(roll) by rows from sines and cosines of roll, pitch and yaw."""
    return [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]


def cross(a: Array, b: Array) -> Array:
    """Return a x b of two vectors (3,)."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def perpendicular(direction: Array) -> Array:
    """Return a unit vector (3,) at right angles to a direction (3,)."""
    across = np.cross(direction, np.eye(3)[int(np.abs(direction).argmin())])
    unit: Array = across / np.linalg.norm(across)
    return unit


# Of rows: vectors (..., 3), quaternions (n, 4), positions of a robot (n, nq).

CROSS_PRODUCT = np.array(
    [[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]],
    dtype=float,
)
"""E with (a @ E).reshape(3, 3) @ b = a x b. Shape (3, 9)."""


def skew(a: Array) -> Array:
    """Return the matrices a~ with a~ b = a x b, (..., 3, 3), of vectors (..., 3)."""
    return np.asarray((a @ CROSS_PRODUCT).reshape(*a.shape[:-1], 3, 3))


def crosses(a: Array, b: Array) -> Array:
    """Return a x b, (..., 3)."""
    return np.asarray(np.matmul(skew(a), b[..., None])[..., 0])


def rotations(q: Array) -> Array:
    """Return the rotation matrices 1 + 2 (w v~ + v~ v~)/|q|^2 (n, 3, 3) of (n, 4), body to world.

    A quaternion off unit length gives the rotation of the unit quaternion along it.
    """
    axis, w = skew(q[:, :3]), q[:, 3, None, None]
    size = np.einsum("ij,ij->i", q, q)[:, None, None]
    return np.asarray(np.eye(3) + 2.0 / size * (w * axis + np.matmul(axis, axis)))


def quaternion_products(p: Array, q: Array) -> Array:
    """Return the products p q (n, 4): q turns first."""
    vector = p[:, 3:] * q[:, :3] + q[:, 3:] * p[:, :3] + crosses(p[:, :3], q[:, :3])
    scalar = p[:, 3] * q[:, 3] - np.einsum("ij,ij->i", p[:, :3], q[:, :3])
    return np.column_stack([vector, scalar])


def quaternion_rates(q: Array, spin: Array) -> Array:
    """Return q' = (w, 0) q / 2, (n, 4), of bodies turning at w (n, 3) [rad/s], world axes."""
    return 0.5 * quaternion_products(np.column_stack([spin, np.zeros(len(spin))]), q)


def turned_quaternions(q: Array, turn: Array) -> Array:
    """Return quaternions (n, 4) turned by rotation vectors (n, 3) [rad], world axes."""
    from scipy.spatial.transform import Rotation

    return unit_quaternions(quaternion_products(Rotation.from_rotvec(turn).as_quat(), q))


def unit_quaternions(q: Array) -> Array:
    """Return quaternions (n, 4) scaled to unit length."""
    return np.asarray(q / np.sqrt(np.einsum("ij,ij->i", q, q))[:, None])


def trunk_yaw(q: Array) -> Array:
    """Return the trunk's yaw (n,) [rad] of a robot's positions (n, nq)."""
    x, y, z, w = q[:, 3:7].T
    yaw: Array = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaw


def trunk_vertical(q: Array) -> Array:
    """Return the world's vertical in the trunk's axes (3,), of one position of a robot (nq,).

    It is the last row of `rotations`; between the cycles of a walk it is needed alone.
    """
    x, y, z, w = q[3:7].tolist()
    twice = 2.0 / (x * x + y * y + z * z + w * w)
    return np.array(
        [twice * (x * z - w * y), twice * (y * z + w * x), 1.0 - twice * (x * x + y * y)]
    )


def yawed(p: Array, yaw: Array) -> Array:
    """Return vectors (..., 2) or (..., 3) turned about z by yaw (...) [rad]."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = c * p[..., 0] - s * p[..., 1], s * p[..., 0] + c * p[..., 1]
    return np.stack([x, y, *(p[..., k] for k in range(2, p.shape[-1]))], axis=-1)


# Of many trunks: components come first, (3, ...) and (3, 3, ...), and formulas are written out by
# component: quick for many rows behind them, and the same bits for any number of rows.


def product(left: Array, right: Array) -> Array:
    """Return the matrix products of two arrays (3, 3, ...)."""
    return np.asarray(left[:, :1] * right[0] + left[:, 1:2] * right[1] + left[:, 2:] * right[2])


def orthonormalised(rotation: Array) -> Array:
    """Return the rotations nearest to (3, 3, ...) that are rotations but for rounding errors.

    One Newton step of the polar decomposition, R (3 - R^T R) / 2.
    """
    correction = -0.5 * product(np.swapaxes(rotation, 0, 1), rotation)
    for i in range(3):
        correction[i, i] += 1.5
    return product(rotation, correction)


def rotation_from_vector(vector: Array) -> Array:
    """Return exp(w~) (3, 3, ...) of rotation vectors w (3, ...) [rad].

    Through the unit quaternion (w sin(|w|/2) / |w|, cos(|w|/2)), which needs no series near 0.
    """
    x, y, z = vector
    half = 0.5 * np.sqrt(x * x + y * y + z * z)
    scale = 0.5 * np.sinc(half / np.pi)  # sin(|w|/2) / |w|
    x, y, z, w = scale * x, scale * y, scale * z, np.cos(half)
    return _matrix(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def roll_pitch_yaw(rotation: Array) -> Array:
    """Return roll, pitch and yaw (3, ...) [rad] of rotations (3, 3, ...).

    Yaw and roll are in [-pi, pi], pitch in [-pi/2, pi/2]. Where pitch is +-pi/2, yaw is one of
    those possible and roll the one that goes with it.
    """
    r = rotation
    yaw = np.arctan2(r[1, 0], r[0, 0])
    pitch = np.arctan2(-r[2, 0], np.sqrt(r[0, 0] * r[0, 0] + r[1, 0] * r[1, 0]))
    cos, sin = np.cos(yaw), np.sin(yaw)
    roll = np.arctan2(sin * r[0, 2] - cos * r[1, 2], cos * r[1, 1] - sin * r[0, 1])
    return np.stack([roll, pitch, yaw])


def rotation_from_angles(angles: Array) -> Array:
    """Return the rotations (3, 3, ...) of roll, pitch and yaw (3, ...) [rad]."""
    return _matrix(_from_angles(*np.sin(angles), *np.cos(angles)))


def _matrix(rows: list[list[Array]]) -> Array:
    """Return (3, 3, ...) from its nine components (...)."""
    matrix = np.empty((3, 3, *rows[0][0].shape))
    for i, row in enumerate(rows):
        for j, component in enumerate(row):
            matrix[i, j] = component
    return matrix
