"""Candidate postures of a leg are scored by their distance from limits and singularities.

The result, or the limit that forbids a posture, is reported in a sentence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.recognition.posture_frame import (
    LegFrame,
    axis_points,
    coxa_choices,
    direction,
    leaning_postures,
    leg_length,
    radial_directions,
    single_link_postures,
    towards,
    with_joint_at,
    within,
)
from hexapod_pin.robot.serial_chain import SerialChain

STROKE_SHARE = 1.0 / 3.0
"""Stroke that a standing leg should be able to walk, in lengths beyond the coxa (*assumed*)."""

LIFT_SHARE = 1.0 / 8.0
"""Lift that it should be able to walk, likewise (*assumed*)."""

LIMIT_SCALE = 0.35
"""Margin to a joint limit of which more is of little worth [rad] (*assumed*)."""

LEAN_SCALE = np.radians(25.0)
"""Lean of the last link that costs as much as a joint at its limit [rad] (*assumed*)."""

CLEARANCE_SHARE = 0.15
"""Clearance of the trunk of which more is of little worth, in lengths (*assumed*)."""

MISSED = 1e-6
"""A place is out of reach when the foot stays further from it, in lengths."""

KNEE_DOWN = 2.0
FOLDED = 1.0
OUT_OF_REACH = 2.0  # per place of the foot
BEYOND_LIMIT = 3.0  # per LIMIT_SCALE
"""What these cost in a score where a good leg has two to three (*assumed*)."""


@dataclass(frozen=True, eq=False)
class LegMeasure:
    """What is needed to judge postures of one leg, (N, J), or of L stacked legs, (L, N, J).

    Attributes:
        foot: chain to the foot's centre.
        second: chain to the second axis' point.
        last: chain to the last walking axis' point.
        ankle: chain to where the link that carries the foot begins.
        hip: the first axis' point [m]. Shape (3,) or (L, 1, 3).
        lower: joint limits [rad]. Shape (J,) or (L, 1, J).
        upper: likewise.
        length: of the leg beyond its first link [m]. Shape () or (L, 1).
        links: product of the lengths of the links beyond the first [m, m^2]. Likewise.
    """

    foot: SerialChain
    second: SerialChain
    last: SerialChain
    ankle: SerialChain
    hip: Array
    lower: Array
    upper: Array
    length: Array
    links: Array

    @staticmethod
    def of(leg: LegFrame) -> LegMeasure:
        """Measure a leg that has walking joints alone."""
        points = axis_points(leg)
        spans = np.linalg.norm(np.diff(np.vstack([points, leg.tip])[1:], axis=0), axis=1)
        end = len(points) - 1
        ankle = points[end] if leg.ankle is None else leg.ankle

        def chain(count: int, point: Array) -> SerialChain:
            return SerialChain.of(leg.axes[:count], points[:count], point)

        return LegMeasure(
            foot=chain(end + 1, leg.tip), second=chain(1, points[1]), last=chain(end, points[end]),
            ankle=chain(end + (leg.ankle is not None), ankle), hip=points[0],
            lower=leg.lower, upper=leg.upper, length=np.array(leg_length(leg)),
            links=np.array(np.prod(spans)),
        )  # fmt: skip

    @staticmethod
    def stack(measures: Sequence[LegMeasure]) -> LegMeasure:
        """Stack legs with equally many joints."""

        def chains(name: str) -> SerialChain:
            return SerialChain.stack([getattr(measure, name) for measure in measures])

        def rows(name: str) -> Array:
            return np.stack([getattr(measure, name) for measure in measures])[:, None]

        return LegMeasure(
            foot=chains("foot"), second=chains("second"), last=chains("last"),
            ankle=chains("ankle"), hip=rows("hip"), lower=rows("lower"), upper=rows("upper"),
            length=rows("length"), links=rows("links"),
        )  # fmt: skip

    def margin(self, q: Array) -> Array:
        """Return the distance of the nearest joint to its limits, negative beyond [rad]. (...)."""
        nearest: Array = np.minimum(q - self.lower, self.upper - q).min(axis=-1)
        return nearest

    def regularity(self, q: Array) -> Array:
        """Return the Jacobian's volume relative to the links' lengths: 0 is singular. (...)."""
        jacobian = self.foot.jacobian(q)
        square = jacobian
        if jacobian.shape[-1] < 3:
            square = np.swapaxes(jacobian, -1, -2) @ jacobian
        volume: Array = np.abs(np.linalg.det(square)) ** (1.0 if square is jacobian else 0.5)
        size = np.asarray(self.length * self.links)
        return np.asarray(volume / np.where(size > 0.0, size, np.inf))


def standing_score(measure: LegMeasure, q: Array, clearance: Array) -> Array:
    """Return the score of postures (..., J) without a look at walking; clearance (...) [m]."""
    tip = measure.foot.forward(q)
    link = _reach(measure.ankle, q) - tip
    lean = np.arccos(np.clip(link[..., 2] / np.linalg.norm(link, axis=-1), -1.0, 1.0))
    free = clearance / (CLEARANCE_SHARE * measure.length)
    score: Array = np.tanh(free) - (lean / LEAN_SCALE) ** 2
    if q.shape[-1] == 2:
        return score
    second, last = _reach(measure.second, q), _reach(measure.last, q)
    thigh, chord = last - second, tip - second
    along = (thigh * chord).sum(axis=-1) / (chord * chord).sum(axis=-1)
    down = thigh[..., 2] <= along * chord[..., 2]
    folded = (thigh * (tip - measure.hip))[..., :2].sum(axis=-1) < 0.0
    return np.asarray(score - KNEE_DOWN * down - FOLDED * folded)


def walking_bound(measure: LegMeasure, q: Array) -> Array:
    """Return what `walking_score` cannot exceed, from where the foot stands alone. (...)."""
    bound: Array = measure.regularity(q) + np.tanh(measure.margin(q) / LIMIT_SCALE)
    return bound


def walking_score(measure: LegMeasure, q: Array) -> Array:
    """Return what postures (..., N, J) are worth in a walk. Shape (..., N).

    The foot is where it stands, half a stroke before and behind it, and lifted.
    """
    moves = np.array([[0, 0, 0], [0.5, 0, 0], [-0.5, 0, 0], [0, 0, 0]]) * STROKE_SHARE
    moves[3, 2] = LIFT_SHARE
    size = measure.length[..., None, None]
    targets = measure.foot.forward(q)[..., None, :, :] + (size * moves[:, None, :])
    count = q.shape[-2]
    start = np.broadcast_to(q[..., None, :, :], (*targets.shape[:-1], q.shape[-1]))
    flat = (*q.shape[:-2], 4 * count)
    moved, miss = towards(
        measure.foot, start.reshape(*flat, -1), targets.reshape(*flat, 3), measure.length
    )
    parts = (*q.shape[:-2], 4, count)
    margin = measure.margin(moved).reshape(parts).min(axis=-2)
    score: Array = measure.regularity(moved).reshape(parts).min(axis=-2)
    score = score + np.tanh(np.maximum(margin, 0.0) / LIMIT_SCALE)
    score = score + BEYOND_LIMIT * np.minimum(margin, 0.0) / LIMIT_SCALE
    if q.shape[-1] == 3:
        missed = (miss > MISSED * measure.length).reshape(parts).sum(axis=-2)
        score = score - OUT_OF_REACH * missed
    return score


def _reach(chain: SerialChain, q: Array) -> Array:
    """Return where the end of a chain of the first joints is [m]. Shape (..., 3)."""
    return chain.forward(q[..., : len(chain.joints)])


def crossing_legs(legs: Sequence[LegFrame], angles: Sequence[Array]) -> list[tuple[int, int]]:
    """Return pairs of legs whose lines from hip to foot cross, seen from above.

    Also with one foot half a stroke before where it stands and the other half a stroke behind.
    """
    hips, tips, strokes = [], [], []
    for leg, q in zip(legs, angles, strict=True):
        measure = LegMeasure.of(leg)
        hips.append(measure.hip[:2])
        tips.append(measure.foot.forward(q)[:2])
        strokes.append(np.array([0.5 * STROKE_SHARE * float(measure.length), 0.0]))
    return [
        (i, j)
        for i, j in combinations(range(len(legs)), 2)
        if any(
            _cross(hips[i], tips[i] + sign * strokes[i], hips[j], tips[j] - sign * strokes[j])
            for sign in (0.0, 1.0, -1.0)
        )
    ]


def _cross(a: Array, b: Array, c: Array, d: Array) -> bool:
    """Return whether the segments a-b and c-d of a plane cross."""

    def side(p: Array, q: Array, r: Array) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0


# Candidate postures of one leg: foot heights and inclinations on a grid.

HEIGHTS = np.arange(2, 21) / 20.0
"""Heights of the second axes above the soles, in mean lengths beyond the coxa."""

LEANS = np.radians([0, 5, 10, 15, 20, 30, 40, 50, 60, 70, 80])
"""Inclinations of the last link from its steepest [rad]."""

FINER_HEIGHTS = np.arange(-4, 5) / 100.0
FINER_LEANS = np.radians(np.arange(-4, 5))
"""Finer steps around the best of these."""

ALL_HEIGHTS = np.arange(-8, 49) / 40.0
"""Heights used where the grid above has no posture."""

SHARES = np.array([8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15, 0, 16]) / 16.0
"""Places in a joint's range used where the grid above has no posture, middle first."""

COXA_SHARES = np.array([4, 3, 5, 2, 6, 1, 7]) / 8.0
"""The same for the first joint."""


def leg_postures(
    leg: LegFrame, coxa: float, outward: Array, tip_height: Array, leans: Array = LEANS
) -> Array:
    """Return the postures on the grid, the first joint at an angle.

    Args:
        leg: with walking joints alone.
        coxa: angle of the first joint [rad].
        outward: from the trunk to this leg. Shape (3,).
        tip_height: heights of the foot's centre in trunk axes [m]. Shape (H,).
        leans: inclinations of the last link from its steepest [rad].

    Returns:
        Joint angles [rad], C postures per height; NaN where there is none. Shape (H, C, J).
    """
    facing = direction(leg, coxa, outward)
    rest, fixed = _without_fixed(leg, {0: coxa})
    if not len(rest.axes):
        return np.full((len(tip_height), 1, len(leg.axes)), np.nan)
    if len(rest.axes) == 2:
        found = leaning_postures(rest, facing, tip_height, leans)
    else:
        found = single_link_postures(rest, facing, tip_height)
    return _assembled(leg, fixed, found.reshape(len(tip_height), -1, len(rest.axes)))


def all_postures(leg: LegFrame, outward: Array, tip_height: Array) -> Array:
    """Return postures with all joints but one at shares of their ranges; arguments as above."""
    free = [k for k in range(len(leg.axes)) if _range(leg, k) > 0.0]
    found = []
    for solved in [k for k in free if k > 0]:
        others = [k for k in free if k != solved]
        grids = np.meshgrid(*[_places(leg, k) for k in others], indexing="ij")
        for places in np.stack([grid.ravel() for grid in grids], axis=-1) if others else [()]:
            rest, fixed = _without_fixed(leg, dict(zip(others, places, strict=True)))
            if len(rest.axes) == 1:
                angles = single_link_postures(rest, outward, tip_height)
                found.append(_assembled(leg, fixed, angles.reshape(len(tip_height), 2, 1)))
    if not found:
        return np.full((len(tip_height), 1, len(leg.axes)), np.nan)
    return np.concatenate(found, axis=1)


def second_axis_height(leg: LegFrame, coxa: float) -> float:
    """Return the height of the second axis' point in trunk axes, the first joint at an angle."""
    return float(axis_points(with_joint_at(leg, 0, coxa))[0][2])


def _without_fixed(leg: LegFrame, at: dict[int, float]) -> tuple[LegFrame, dict[int, float]]:
    """Return the leg with some joints at angles, and those that cannot move, and all of these."""
    fixed = {k: leg.lower[k] for k in range(len(leg.axes)) if _range(leg, k) <= 0.0} | at
    for k in sorted(fixed, reverse=True):
        leg = with_joint_at(leg, k, fixed[k])
    return leg, fixed


def _assembled(leg: LegFrame, fixed: dict[int, float], found: Array) -> Array:
    """Return angles of all joints from those of the joints that were free (H, C, free)."""
    free = [k for k in range(len(leg.axes)) if k not in fixed]
    angles = np.empty((*found.shape[:2], len(leg.axes)))
    angles[..., free] = within(found, leg.lower[free], leg.upper[free])
    for k, value in fixed.items():
        angles[..., k] = np.where(np.isnan(found).any(axis=-1), np.nan, value)
    return angles


def _range(leg: LegFrame, joint: int) -> float:
    """Return the width of a joint's limits [rad]."""
    return float(leg.upper[joint] - leg.lower[joint])


def _places(leg: LegFrame, joint: int) -> Array:
    """Return angles over a joint's range; over a turn where it has no limits [rad]."""
    lower, upper = leg.lower[joint], leg.upper[joint]
    if not np.isfinite(upper - lower):
        lower, upper = -np.pi, np.pi
    shares = SHARES if joint else COXA_SHARES
    return np.asarray(lower + shares * (upper - lower))


# The description of a standing posture, or the limit that prevents one.

WAY_OUT = "Widen the limits, or state the standing angles with posture=[...]."


def sentence(legs: Sequence[LegFrame], angles: Sequence[Array], sole: float) -> str:
    """Return how a robot stands: height below the hips, lean of the tibiae, nearest limit.

    Limits of held joints are left out.
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
        f"feet {np.mean(below):.3g} m below the hips, tibiae {_span(lean)} deg from vertical, "
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


def _span(values: Sequence[float]) -> str:
    """Return one number, or the smallest and the largest where they differ."""
    low, high = f"{min(values):.0f}", f"{max(values):.0f}"
    return low if low == high else f"{low} to {high}"
