"""The search of a standing posture takes legs in trunk axes.

Joint angles for a foot height have closed forms; the first joints stand in the middle of their
limits or point outwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot import serial_chain
from hexapod_pin.robot.serial_chain import JointAxis, SerialChain


@dataclass(frozen=True, eq=False)
class LegFrame:
    """One leg at q = 0 in trunk axes (x forward, y left, z up; origin of the root link).

    Attributes:
        name: of the leg.
        axes: unit joint axes, from the trunk outwards. Shape (k, 3).
        origins: a point on each axis [m]. Shape (k, 3).
        tip: centre of the foot sphere [m]. Shape (3,).
        radius: of that sphere [m].
        lower: lower joint limits [rad]; -inf where there is none. Shape (k,).
        upper: upper joint limits [rad]; inf where there is none. Shape (k,).
        walking: which joints walk, from the trunk outwards. Two or three; the others are held.
        joints: names of the joints, for messages; empty: "joint 1" and so on. k or none.
        ankle: where the link that carries the foot begins, when its joint is held already [m];
            None: at the last joint. Shape (3,).
    """

    name: str
    axes: Array
    origins: Array
    tip: Array
    radius: float
    lower: Array
    upper: Array
    walking: tuple[int, ...]
    joints: tuple[str, ...] = ()
    ankle: Array | None = None

    def joint(self, index: int) -> str:
        """Return the name of one joint."""
        return self.joints[index] if self.joints else f"joint {index + 1}"


@dataclass(frozen=True, eq=False)
class StandingPosture:
    """How a robot stands.

    Attributes:
        angles: of every joint, walking or held, leg by leg [rad]. Shape (k,) each.
        height: of the origin of the root link above the ground [m].
        reason: one sentence: how the feet stand, and how near the limits are.
    """

    angles: tuple[Array, ...]
    height: float
    reason: str


def with_joint_at(leg: LegFrame, index: int, angle: float) -> LegFrame:
    """Return the leg with one joint at an angle [rad] and no longer a joint.

    Its place in `walking` is lost; the places of the joints beyond it move down.
    """
    axis = JointAxis.of(leg.axes[index], leg.origins[index])
    c, s = np.cos([angle]), np.sin([angle])
    axes, origins = leg.axes.copy(), leg.origins.copy()
    axes[index + 1 :] = axis.rotate(axes[index + 1 :], c, s)
    origins[index + 1 :] = axis.turned(origins[index + 1 :], angle)
    if leg.ankle is not None:
        ankle: Array | None = axis.turned(leg.ankle, angle)
    else:
        ankle = axis_points(leg)[index] if index == len(axes) - 1 else None
    left = [k for k in range(len(axes)) if k != index]
    return replace(
        leg,
        axes=axes[left],
        origins=origins[left],
        tip=axis.turned(leg.tip, angle),
        ankle=ankle,
        lower=leg.lower[left],
        upper=leg.upper[left],
        walking=tuple(k - (k > index) for k in leg.walking if k != index),
        joints=tuple(leg.joints[k] for k in left) if leg.joints else (),
    )


def axis_points(leg: LegFrame) -> Array:
    """Return the points of a leg's axes that no convention moves [m]. Shape (k, 3)."""
    return serial_chain.axis_points(leg.axes, leg.origins, leg.tip)


def leg_length(leg: LegFrame) -> float:
    """Return the length of the leg beyond its first walking joint's link [m]."""
    points = np.vstack([axis_points(leg), leg.tip])
    return float(np.linalg.norm(np.diff(points[leg.walking[0] + 1 :], axis=0), axis=1).sum())


def middle_of(lower: Array, upper: Array) -> Array:
    """Return the middle of joint limits, 0 for a joint without [rad]."""
    bounded = np.isfinite(lower) & np.isfinite(upper)
    low, high = np.where(bounded, lower, 0.0), np.where(bounded, upper, 0.0)
    return np.asarray(0.5 * (low + high))


# Joint angles that put a foot at a height: closed forms that hold for axes of any direction.
#
# A vector v perpendicular to an axis a, turned about it by q, has the height
# z(q) = R cos(q - q_top), with R cos(q_top) = v_z and R sin(q_top) = (a x v)_z.

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


# Angles of the legs' first joints: the middle of their limits, or outwards.

UP = np.array([0.0, 0.0, 1.0])

WIDE_RANGE = np.radians(250.0)
"""The middle of limits wider than this does not determine how a leg should point [rad]."""

INWARD = np.radians(70.0)
"""A leg points inwards when it is further than this from outwards and from sideways [rad]."""

RADIAL_GAP = 0.2
RADIAL_SPREAD = 0.15
"""Hips are on a circle when gaps and radii are equal to these shares."""

CLEAR_OFFSET = 0.02
"""Share of a leg beyond the first axis from which the second one gives the leg's direction."""

EDGE_SHARE = 0.25
"""A coxa that cannot point outwards stays this share of its range from its limits."""


def coxa_choices(legs: Sequence[LegFrame]) -> list[Array]:
    """Return angles of the first joints, (L,) each [rad], the preferred choice first.

    The legs have walking joints alone. First: the middle of the limits, outwards where that points
    inwards or the limits are wide; then outwards for all, radially for all, the middle for all.
    """
    hips = np.array([axis_points(leg)[0] for leg in legs])
    radial = _radial(hips)
    side = np.outer(np.sign(hips[:, 1] - hips[:, 1].mean()), [0.0, 1.0, 0.0])
    out = radial if _on_a_circle(hips) else side
    outward = np.array([_towards(*row) for row in zip(legs, out, radial, strict=True)])
    spread = np.array([_towards(*row) for row in zip(legs, radial, radial, strict=True)])
    limits = np.array([[leg.lower[0], leg.upper[0]] for leg in legs])
    bounded = np.isfinite(limits).all(axis=1)
    middle = np.where(bounded, middle_of(*limits.T), outward)
    inside = [
        leg.upper[0] - leg.lower[0] <= WIDE_RANGE
        and max(direction(leg, q, r) @ r, direction(leg, q, r) @ s) >= np.cos(INWARD)
        for leg, q, r, s in zip(legs, middle, radial, side, strict=True)
    ]
    choices = [np.where(inside, middle, outward), outward, spread, middle]
    return [q for k, q in enumerate(choices) if not any(np.allclose(q, p) for p in choices[:k])]


def direction(leg: LegFrame, angle: float, outward: Array) -> Array:
    """Return the horizontal direction in which a leg points, its first joint at an angle. (3,).

    It is across the second axis, to the side where that axis lies; where it meets the first axis,
    to the side of `outward`.
    """
    points = axis_points(leg)
    joint = JointAxis.of(leg.axes[0], points[0])
    cos, sin = np.cos([angle]), np.sin([angle])
    second, beyond = joint.rotate(np.stack([leg.axes[1], points[1] - points[0]]), cos, sin)
    across = np.cross(second, UP)
    length = float(np.linalg.norm(across))
    if length < 0.1:  # the second axis is upright: the leg points to its foot
        across = joint.rotate(leg.tip - points[0], cos, sin) * [1.0, 1.0, 0.0]
        return across / max(float(np.linalg.norm(across)), 1e-12)
    across = across / length
    offset = float(across @ beyond)
    if abs(offset) < CLEAR_OFFSET * leg_length(leg):
        offset = float(across @ outward)
    return across if offset >= 0.0 else -across


def _towards(leg: LegFrame, target: Array, outward: Array) -> float:
    """Return the first joint's angle that points a leg in a direction, inside its limits [rad]."""
    now, axis = direction(leg, 0.0, outward), leg.axes[0]
    along = target @ now - (axis @ target) * (axis @ now)
    angle = np.array([np.arctan2(target @ np.cross(axis, now), along)])
    lower, upper = leg.lower[0], leg.upper[0]
    angle = within(angle, leg.lower[:1], leg.upper[:1])
    if np.isfinite(upper - lower):
        edge = EDGE_SHARE * (upper - lower)
        angle = np.clip(angle, lower + edge, upper - edge)
    return float(angle[0])


def radial_directions(legs: Sequence[LegFrame]) -> Array:
    """Return the horizontal unit vectors from the middle of the hips to each. Shape (L, 3)."""
    return _radial(np.array([axis_points(leg)[leg.walking[0]] for leg in legs]))


def _radial(hips: Array) -> Array:
    """Return the horizontal unit vectors from the middle of the hips to each. Shape (L, 3)."""
    out = (hips - hips.mean(axis=0)) * [1.0, 1.0, 0.0]
    length = np.linalg.norm(out, axis=1, keepdims=True)
    rows: Array = np.where(length > 0.0, out / np.maximum(length, 1e-12), [1.0, 0.0, 0.0])
    return rows


def _on_a_circle(hips: Array) -> bool:
    """Return whether hips are evenly spread on a circle."""
    out = hips - hips.mean(axis=0)
    radius = np.hypot(out[:, 0], out[:, 1])
    azimuth = np.sort(np.arctan2(out[:, 1], out[:, 0]))
    gaps = np.diff(azimuth, append=azimuth[0] + 2.0 * np.pi) * len(hips) / (2.0 * np.pi)
    even = np.abs(gaps - 1.0).max() <= RADIAL_GAP
    return bool(even and np.ptp(radius) <= RADIAL_SPREAD * radius.mean())
