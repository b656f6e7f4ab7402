"""Joint rates of a leg and its distance from a singular posture: by the Jacobian, or closed form.

The closed form costs a small part of the Jacobian and serves where thousands of postures are only
judged; it differs from the Jacobian by rounding.
"""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.yaw_pitch_pitch import YawPitchPitch


def joint_rates(jacobian: Array, v_BF: Array, task: Array | None = None) -> Array:
    """Return the joint rates [rad/s] that move a foot at v_BF [m/s].

    Args:
        jacobian: d p_BF / d q [m/rad]. Shape (..., 3, J).
        v_BF: foot velocity in base axes. Shape (..., 3).
        task: directions that legs of two joints follow, as of `LegGeometry`; None: all three.
            Shape (..., 2, 3).

    Returns:
        Shape (..., J).
    """
    if task is not None:
        jacobian, v_BF = task @ jacobian, (task @ v_BF[..., None])[..., 0]
    return np.asarray(np.linalg.solve(jacobian, v_BF[..., None])[..., 0], dtype=np.float64)


def normalised_determinant(jacobian: Array, task: Array | None = None) -> Array:
    """Return |det J| over the product of the lengths of J's columns. (..., 3, J) -> (...).

    Of legs of two joints J's determinant is that of its components along the task, (..., 2, 3):
    it vanishes also where neither joint moves the foot along the direction of travel.
    """
    size = np.prod(np.linalg.norm(jacobian, axis=-2), axis=-1)
    jacobian = jacobian if task is None else task @ jacobian
    share: Array = np.abs(np.linalg.det(jacobian)) / np.maximum(size, np.finfo(float).tiny)
    return share


def closed_form_rates(
    geometry: YawPitchPitch, fold: Array, p_BF: Array, v_BF: Array, q: Array
) -> Array:
    """Return `joint_rates` of L stacked yaw-pitch-pitch legs away from singular postures.

    Args:
        geometry: of the legs.
        fold: -1 for a leg folded over its yaw axis, else 1. Shape (L, 1).
        p_BF: foot positions in the base frame [m]. Shape (L, N, 3).
        v_BF: foot velocities in base axes [m/s]. Shape (L, N, 3).
        q: joint angles that reach the positions on that branch [rad]. Shape (L, N, 3).

    Returns:
        Shape (L, N, 3).
    """
    p_HF = (p_BF - geometry.p_BH) @ geometry.r_BH
    v_HF = v_BF @ geometry.r_BH
    x, y, z = p_HF[..., 0], p_HF[..., 1], p_HF[..., 2]
    dx, dy, dz = v_HF[..., 0], v_HF[..., 1], v_HF[..., 2]
    l1, l2, l3 = geometry.links
    q3 = geometry.sign[..., 2] * q[..., 2] + geometry.offset[..., 2]
    radius = np.sqrt(x**2 + y**2)
    u, du = fold * radius - l1, fold * (x * dx + y * dy) / radius
    dq1 = (x * dy - y * dx) / radius**2
    dq3 = -(u * du + z * dz) / (l2 * l3 * np.sin(q3))
    dq2 = (z * du - u * dz - l3 * (l3 + l2 * np.cos(q3)) * dq3) / (u**2 + z**2)
    rates: Array = geometry.sign * np.stack([dq1, dq2, dq3], axis=-1)
    return rates


def closed_form_determinant(geometry: YawPitchPitch, q: Array) -> Array:
    """Return `normalised_determinant` of L stacked yaw-pitch-pitch legs: L2 |sin q3| / rho.

    rho is the distance from axis 2 to the foot. The columns have the lengths r (the foot's distance
    from the yaw axis), rho and L3, and |det J| = L2 L3 |sin q3| r.

    Args:
        geometry: of the legs.
        q: joint angles [rad]. Shape (L, N, 3).

    Returns:
        Shape (L, N).
    """
    _, l2, l3 = geometry.links
    q3 = geometry.sign[..., 2] * q[..., 2] + geometry.offset[..., 2]
    sin, cos = np.sin(q3), np.cos(q3)
    rho = np.sqrt((l2 + l3 * cos) ** 2 + (l3 * sin) ** 2)
    share: Array = l2 * np.abs(sin) / np.maximum(rho, np.finfo(float).tiny)
    return share
