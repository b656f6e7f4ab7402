"""Joint angles that put a foot at a height: closed forms that hold for axes of any direction.

A vector v perpendicular to an axis a, turned about it by q, has the height
z(q) = R cos(q - q_top), with R cos(q_top) = v_z and R sin(q_top) = (a x v)_z.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.posture_frame import LegFrame, axis_points, middle_of
from hexapod_pin.robot.serial_chain import JointAxis, SerialChain

LEAN_STEPS = 6
"""Corrections of the tibia's height where axes are not parallel; each gains the axes' tilt."""

DROP_TOLERANCE = 1e-15
"""The tibia's height is known when a correction is smaller than this share of its length."""

NEWTON_STEPS = 5
MAX_NEWTON_STEP = 0.4  # of one joint [rad]
DAMPING = 1e-12  # of Newton steps, relative to the squared length


def leaning_postures(leg: LegFrame, outward: Array, tip_height: Array, lean: Array) -> Array:
    """Return angles of two joints that put the foot at heights, its last link at inclinations.

    Args:
        leg: with two joints left, neither of them upright.
        outward: horizontal direction of the leg. Shape (3,).
        tip_height: of the foot's centre in trunk axes [m]. Shape (H,).
        lean: between the last link and its steepest direction, not negative [rad]. Shape (T,).

    Returns:
        Angles [rad], NaN where there are none. Shape (H, T, 2, 2, 2): height, lean, first link
        outwards or inwards, foot outside or inside of the knee, joint.
    """
    (a2, a3), (p2, p3) = leg.axes, axis_points(leg)
    first, last = JointAxis.of(a2, p2), JointAxis.of(a3, p3)
    v2, v3 = p3 - p2, leg.tip - p3
    reach2, top2 = _top(a2, v2)
    shape = (len(tip_height), len(lean), 2, 2)
    side, foot = np.array([1.0, -1.0])[:, None], np.array([1.0, -1.0])
    cos_lean = np.cos(lean)[None, :, None, None]
    drop = np.full(shape, np.linalg.norm(v3))
    for _ in range(LEAN_STEPS):
        height = tip_height[:, None, None, None] + drop * cos_lean - p2[2]
        with np.errstate(invalid="ignore", divide="ignore"):
            q2 = top2 + side * np.arccos(height / reach2)
        c, s = np.cos(q2)[..., None], np.sin(q2)[..., None]
        unit = first.rotate(np.broadcast_to(a3, (*shape, 3)), c, s)
        before, drop = drop, np.linalg.norm(v3) * np.sqrt(np.maximum(1.0 - unit[..., 2] ** 2, 0.0))
        if not (np.abs(drop - before) > DROP_TOLERANCE * np.linalg.norm(v3)).any():
            break
    link = first.rotate(np.broadcast_to(v3, (*shape, 3)), c, s)
    across = np.cross(unit, link)[..., 2]
    q3 = np.arctan2(across, link[..., 2]) + np.pi + foot * lean[None, :, None, None]
    angles = np.stack([q2, q3], axis=-1)
    elbow = first.rotate(np.broadcast_to(v2, (*shape, 3)), c, s) @ outward
    c3, s3 = np.cos(angles[..., 1])[..., None], np.sin(angles[..., 1])[..., None]
    outside = first.rotate(last.rotate(np.broadcast_to(v3, (*shape, 3)), c3, s3), c, s) @ outward
    angles = _outward_first(angles, outside, axis=3)
    return _outward_first(angles, np.take(elbow, [0], axis=3), axis=2)


def single_link_postures(leg: LegFrame, outward: Array, tip_height: Array) -> Array:
    """Return angles of the one joint left that put the foot at heights.

    Args:
        leg: with one joint left, not upright.
        outward: horizontal direction of the leg. Shape (3,).
        tip_height: [m]. Shape (H,).

    Returns:
        [rad], NaN where there are none. Shape (H, 1, 2, 1, 1), as `leaning_postures`.
    """
    point = axis_points(leg)[0]
    reach, top = _top(leg.axes[0], leg.tip - point)
    with np.errstate(invalid="ignore", divide="ignore"):
        away = np.arccos((tip_height - point[2]) / reach)
    q = (top + away[:, None] * np.array([1.0, -1.0]))[:, None, :, None, None]
    axis = JointAxis.of(leg.axes[0], point)
    link = np.broadcast_to(leg.tip - point, (*q.shape[:-1], 3))
    elbow = axis.rotate(link, np.cos(q), np.sin(q)) @ outward
    return _outward_first(q, elbow, axis=2)


def at_height(chain: SerialChain, q: Array, joints: Sequence[int], height: float) -> Array:
    """Return angles (J,) with one joint moved by Newton steps until the foot is at a height.

    Of `joints` the one that moves the foot most steeply is taken.
    """
    q, rates = q.copy(), chain.jacobian(q)[2]
    joint = max(joints, key=lambda k: abs(rates[k]))
    for _ in range(3):
        p, jacobian = chain.forward_and_jacobian(q)
        q[joint] += (height - p[2]) / jacobian[2, joint]
    return q


def towards(chain: SerialChain, q: Array, target: Array, length: Array) -> tuple[Array, Array]:
    """Return angles after damped Newton steps from angles to targets, and their misses [m].

    Args:
        chain: of one leg, or of L stacked legs.
        q: [rad]. Shape (N, J) or (L, N, J).
        target: places of the foot [m]. Shape (N, 3) or (L, N, 3).
        length: of the leg [m]. Shape () or (L, 1).
    """
    unit = (DAMPING * length**2)[..., None, None] * np.eye(q.shape[-1])
    for _ in range(NEWTON_STEPS):
        p, jacobian = chain.forward_and_jacobian(q)
        transposed = np.swapaxes(jacobian, -1, -2)
        right = transposed @ (target - p)[..., None]
        step = np.linalg.solve(transposed @ jacobian + unit, right)[..., 0]
        q = q + np.clip(step, -MAX_NEWTON_STEP, MAX_NEWTON_STEP)
    return q, np.linalg.norm(chain.forward(q) - target, axis=-1)


def within(q: Array, lower: Array, upper: Array) -> Array:
    """Return angles moved by whole turns to the middle of their limits, or to zero without any."""
    middle = middle_of(lower, upper)
    # A hair below half a turn, so that rounding does not decide between its two ends.
    turns = np.ceil((q - middle) / (2.0 * np.pi) - 0.5 - 1e-9)
    moved: Array = q - 2.0 * np.pi * turns
    return moved


def _top(axis: Array, link: Array) -> tuple[float, float]:
    """Return R and q_top of a link perpendicular to an axis."""
    across = float(axis[0] * link[1] - axis[1] * link[0])
    return float(np.hypot(link[2], across)), float(np.arctan2(across, link[2]))


def _outward_first(angles: Array, outward: Array, axis: int) -> Array:
    """Swap the two solutions along an axis where the second reaches further outwards."""
    first, second = np.take(outward, [0], axis=axis), np.take(outward, [1], axis=axis)
    swap = (second > first)[..., None]
    return np.where(swap, np.flip(angles, axis=axis), angles)
