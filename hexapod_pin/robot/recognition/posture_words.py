"""What is said of a standing posture: how the feet stand, or which limit forbids one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.recognition.posture_candidates import (
    ALL_HEIGHTS,
    leg_postures,
    second_axis_height,
)
from hexapod_pin.robot.recognition.posture_coxa import coxa_choices, radial_directions
from hexapod_pin.robot.recognition.posture_frame import LegFrame, axis_points, leg_length
from hexapod_pin.robot.serial_chain import SerialChain

WAY_OUT = "Widen the limits, or state the standing angles with posture=[...]."


def sentence(legs: Sequence[LegFrame], angles: Sequence[Array], sole: float) -> str:
    """Return how a robot stands: height below the hips, lean of the tibiae, nearest limit.

    Limits of joints that are held are not spoken of.
    """
    below, lean, margin = [], [], []
    for leg, q in zip(legs, angles, strict=True):
        chain = SerialChain.of(leg.axes, leg.origins, leg.tip)
        points = axis_points(leg)
        second, last = leg.walking[1], len(leg.axes) - 1
        hip = SerialChain.of(leg.axes[:second], leg.origins[:second], points[second])
        knee = SerialChain.of(leg.axes[:last], leg.origins[:last], points[last])
        link = knee.forward(q[:last]) - chain.forward(q)
        below.append(float(hip.forward(q[:second])[2]) - sole)
        lean.append(float(np.degrees(np.arccos(link[2] / np.linalg.norm(link)))))
        free = [k for k in leg.walking if leg.upper[k] > leg.lower[k]]
        nearest = np.minimum(q - leg.lower, leg.upper - q)[free]
        margin.append(float(np.degrees(nearest.min(initial=np.inf))))
    limit = f"{min(margin):.0f} deg away" if np.isfinite(min(margin)) else "none"
    return (
        f"feet {np.mean(below):.3g} m below the hips, tibiae {_range(lean)} deg from vertical, "
        f"nearest joint limit {limit}"
    )


def refusal(legs: Sequence[LegFrame], trunk_low: float | None) -> ReachError:
    """Return why legs with walking joints alone have no standing posture."""
    coxa, outward = coxa_choices(legs)[0], radial_directions(legs)
    worst = (-np.inf, 0, 0, 0.0)
    for index, leg in enumerate(legs):
        hip = second_axis_height(leg, float(coxa[index]))
        heights = hip - ALL_HEIGHTS[ALL_HEIGHTS > 0.0] * leg_length(leg) + leg.radius
        q = leg_postures(leg, float(coxa[index]), outward[index], heights)
        q = q[np.isfinite(q).all(axis=-1)]
        if not len(q):
            return ReachError(leg.name, f"no posture puts its foot below its hip. {WAY_OUT}")
        beyond = np.maximum(leg.lower - q, q - leg.upper)
        row = int(np.argmin(beyond.max(axis=1)))
        joint = int(np.argmax(beyond[row]))
        if beyond[row, joint] > worst[0]:
            worst = float(beyond[row, joint]), index, joint, float(q[row, joint])
    excess, index, joint, angle = worst
    leg = legs[index]
    if excess > 0.0:
        lower, upper = leg.lower[joint], leg.upper[joint]
        return ReachError(
            leg.name,
            f"no standing posture: the nearest has joint {leg.joint(joint)} at {angle:.4g} rad; "
            f"its limits are {lower:.4g} to {upper:.4g} rad. {WAY_OUT}",
        )
    low = "" if trunk_low is None else f" and the trunk's lowest point ({trunk_low:.4g} m) is clear"
    return ReachError(
        leg.name,
        f"no standing posture: inside the joint limits there is no height at which all feet are "
        f"level{low}; nearest to a limit is joint {leg.joint(joint)}. {WAY_OUT}",
    )


def _range(values: Sequence[float]) -> str:
    """Return one number, or the smallest and the largest where they differ."""
    low, high = f"{min(values):.0f}", f"{max(values):.0f}"
    return low if low == high else f"{low} to {high}"
