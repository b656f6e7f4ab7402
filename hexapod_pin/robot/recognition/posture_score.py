"""How good a standing leg is: what it keeps from its limits and from singularity while it walks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.posture_frame import LegFrame, axis_points, leg_length
from hexapod_pin.robot.recognition.posture_kinematics import towards
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

    Looked at: where the foot stands, half a stroke before and behind it, and lifted.
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
    """Tell whether the segments a-b and c-d of a plane cross."""

    def side(p: Array, q: Array, r: Array) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0
