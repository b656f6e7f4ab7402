"""Knots of a walk: joint angles and rates, dense enough for the cubics between them."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.six_legs import SixLegs
from hexapod_pin.robot.leg_velocity import joint_rates

MAX_KNOT_SPACING = 0.01
"""Largest spacing of the knots [s]."""

MAX_KNOT_ERROR = 1e-6
"""Largest error of the cubic between knots, in joint angle [rad]."""

SPACING_TOLERANCE = 1e-9
"""Share of a spacing by which a span may be longer than a whole number of them."""


def walk_knots(six: SixLegs, path: FootPath, end: float) -> tuple[Array, Array, Array]:
    """Return times, angles and rates, halving the spacing until the cubics are close enough."""
    events = np.concatenate([[0.0], path.events(end), [end]])
    spacing = MAX_KNOT_SPACING
    while True:
        time = knot_times(events, spacing)
        both = np.empty(2 * len(time) - 1)
        both[::2], both[1::2] = time, 0.5 * (time[:-1] + time[1:])
        p_BF, v_BF = six.foot_motion(path, both)
        q = six.kinematics.inverse(p_BF)
        v = joint_rates(six.kinematics.jacobian(q[:, ::2]), v_BF[:, ::2])
        if _midpoint_error(time, q, v).max() <= 0.5 * MAX_KNOT_ERROR:
            return time, six.joint_rows(q[:, ::2], six.posture), six.joint_rows(v, 0.0)
        spacing *= 0.5


def knot_times(events: Array, spacing: float) -> Array:
    """Return times that part each span between events evenly, at most `spacing` apart [s]."""
    length = np.diff(events)
    pieces = np.ceil(length / spacing - SPACING_TOLERANCE).astype(int)
    first = np.cumsum(pieces) - pieces
    within = np.arange(pieces.sum()) - np.repeat(first, pieces)
    times = within * np.repeat(length / pieces, pieces) + np.repeat(events[:-1], pieces)
    return np.append(times, events[-1])


def _midpoint_error(time: Array, q: Array, v: Array) -> Array:
    """Return how far the cubic of each interval misses its mid-point [rad]. Shape (K - 1,).

    Args:
        time: knot times [s]. Shape (K,).
        q: angles at knots and mid-points in turn [rad]. Shape (6, 2 K - 1, 3).
        v: rates at the knots [rad/s]. Shape (6, K, 3).
    """
    eighth = 0.125 * np.diff(time)[:, None]
    cubic = 0.5 * (q[:, :-1:2] + q[:, 2::2]) + eighth * (v[:, :-1] - v[:, 1:])
    error: Array = np.abs(cubic - q[:, 1::2]).max(axis=(0, 2))
    return error
