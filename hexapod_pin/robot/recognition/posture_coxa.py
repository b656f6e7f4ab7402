"""Where the first joints of the legs stand: in the middle of their limits, or outwards."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.posture_frame import LegFrame, axis_points, leg_length, middle_of
from hexapod_pin.robot.recognition.posture_kinematics import within
from hexapod_pin.robot.serial_chain import JointAxis

UP = np.array([0.0, 0.0, 1.0])

WIDE_RANGE = np.radians(250.0)
"""The middle of limits wider than this says nothing of how a leg should point [rad]."""

INWARD = np.radians(70.0)
"""A leg points inwards when it is further than this from outwards and from sideways [rad]."""

RADIAL_GAP = 0.2
RADIAL_SPREAD = 0.15
"""Hips are on a circle when gaps and radii are equal to these shares."""

CLEAR_OFFSET = 0.02
"""The second axis tells which way a leg points where it is this share of a leg beyond the first."""

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
    kept = [
        leg.upper[0] - leg.lower[0] <= WIDE_RANGE
        and max(direction(leg, q, r) @ r, direction(leg, q, r) @ s) >= np.cos(INWARD)
        for leg, q, r, s in zip(legs, middle, radial, side, strict=True)
    ]
    choices = [np.where(kept, middle, outward), outward, spread, middle]
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
    """Tell whether hips are evenly spread on a circle."""
    out = hips - hips.mean(axis=0)
    radius = np.hypot(out[:, 0], out[:, 1])
    azimuth = np.sort(np.arctan2(out[:, 1], out[:, 0]))
    gaps = np.diff(azimuth, append=azimuth[0] + 2.0 * np.pi) * len(hips) / (2.0 * np.pi)
    even = np.abs(gaps - 1.0).max() <= RADIAL_GAP
    return bool(even and np.ptp(radius) <= RADIAL_SPREAD * radius.mean())
