"""Unit quaternions (x, y, z, w) and cross-product matrices, many at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array


def _cross_table() -> Array:
    """Return E with (a @ E).reshape(3, 3) @ b = a x b. Shape (3, 9)."""
    table = np.zeros((3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        table[i, k, j], table[j, k, i] = 1.0, -1.0  # (e_i x e_j)_k = 1
    return table.reshape(3, 9)


def _product_table() -> Array:
    """Return P with (p outer q) @ P the quaternion product p q. Shape (16, 4)."""
    table = np.zeros((4, 4, 4))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        table[i, j, k], table[j, i, k] = 1.0, -1.0
        table[i, 3, i] = table[3, i, i] = 1.0
        table[i, i, 3] = -1.0
    table[3, 3, 3] = 1.0
    return table.reshape(16, 4)


def _rotation_table() -> Array:
    """Return T with (q outer q) @ T the rotation matrix of a unit quaternion. Shape (16, 9)."""
    table = np.zeros((4, 4, 3, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        table[3, 3, i, i] = table[i, i, i, i] = 1.0
        table[j, j, i, i] = table[k, k, i, i] = -1.0
        table[i, j, i, j] += 2.0
        table[i, j, j, i] += 2.0
        table[k, 3, i, j], table[k, 3, j, i] = -2.0, 2.0
    return table.reshape(16, 9)


CROSS, PRODUCT, ROTATION = _cross_table(), _product_table(), _rotation_table()


def skew(a: Array) -> Array:
    """Return the matrices a~ with a~ b = a x b, (..., 3, 3), of vectors (..., 3)."""
    found: Array = (a @ CROSS).reshape(*a.shape[:-1], 3, 3)
    return found


def cross(a: Array, b: Array) -> Array:
    """Return a x b, (..., 3)."""
    found: Array = np.matmul(skew(a), b[..., None])[..., 0]
    return found


def rotations(q: Array) -> Array:
    """Return the rotation matrices (n, 3, 3) of quaternions (n, 4), body to world.

    A quaternion off unit length gives the rotation of the unit quaternion along it.
    """
    pairs = (q[:, :, None] * q[:, None, :]).reshape(-1, 16)
    size = np.einsum("ij,ij->i", q, q)
    found: Array = ((pairs @ ROTATION) / size[:, None]).reshape(-1, 3, 3)
    return found


def product(p: Array, q: Array) -> Array:
    """Return the products p q (n, 4): q turns first."""
    found: Array = (p[:, :, None] * q[:, None, :]).reshape(-1, 16) @ PRODUCT
    return found


def quaternion_rate(q: Array, spin: Array) -> Array:
    """Return q' = (w, 0) q / 2, (n, 4), of bodies turning at w (n, 3) [rad/s], world axes."""
    pairs = (spin[:, :, None] * q[:, None, :]).reshape(-1, 12)
    found: Array = pairs @ (0.5 * PRODUCT[:12])
    return found


def turned(q: Array, turn: Array) -> Array:
    """Return quaternions (n, 4) turned by rotation vectors (n, 3) [rad], world axes."""
    angle = np.linalg.norm(turn, axis=1)
    step = np.empty_like(q)
    step[:, :3] = 0.5 * np.sinc(0.5 * angle / np.pi)[:, None] * turn
    step[:, 3] = np.cos(0.5 * angle)
    return normalised(product(step, q))


def normalised(q: Array) -> Array:
    """Return quaternions of unit length."""
    return np.asarray(q / np.sqrt(np.einsum("ij,ij->i", q, q))[:, None])


def from_matrix(rotation: Array) -> Array:
    """Return the unit quaternion (4,) of a rotation matrix (3, 3).

    The eigenvector of the largest eigenvalue of Bar-Itzhack's matrix: no case distinctions.
    """
    matrix = (ROTATION @ rotation.reshape(9)).reshape(4, 4)
    values, vectors = np.linalg.eigh(matrix + matrix.T)
    return np.asarray(vectors[:, np.argmax(values)])
