"""Rotations of many trunks at a time: rotation vectors, and roll, pitch and yaw.

Components come first, (3, ...) and (3, 3, ...), and formulas are written out by component: quick
for many rows behind them, and the same bits for any number of rows.
"""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array


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
    """Return roll, pitch and yaw (3, ...) [rad] of Rz(yaw) Ry(pitch) Rx(roll), (3, 3, ...).

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
    """Return Rz(yaw) Ry(pitch) Rx(roll) (3, 3, ...) of roll, pitch and yaw (3, ...) [rad]."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles), np.cos(angles)
    return _matrix(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _matrix(rows: list[list[Array]]) -> Array:
    """Return (3, 3, ...) from its nine components (...)."""
    matrix = np.empty((3, 3, *rows[0][0].shape))
    for i, row in enumerate(rows):
        for j, component in enumerate(row):
            matrix[i, j] = component
    return matrix
