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

KNEE_DOWN = 2.0
FOLDED = 1.0
OUT_OF_REACH = 2.0
BEYOND_LIMIT = 3.0  # per LIMIT_SCALE
"""What these cost in a score where a good leg has two to three (*assumed*)."""


@dataclass(frozen=True, eq=False)
class LegMeasure:
    """A leg's chain with what is needed to judge its postures."""

    leg: LegFrame
    chain: SerialChain
    points: Array
    length: float
    links: float

    @staticmethod
    def of(leg: LegFrame) -> LegMeasure:
        """Measure a leg that has walking joints alone."""
        points = axis_points(leg)
        spans = np.linalg.norm(np.diff(np.vstack([points, leg.tip])[1:], axis=0), axis=1)
        chain = SerialChain.of(leg.axes, points, leg.tip)
        return LegMeasure(leg, chain, points, leg_length(leg), float(np.prod(spans)))

    def margin(self, q: Array) -> Array:
        """Return the distance of the nearest joint to its limits, negative beyond [rad]. (...)."""
        nearest: Array = np.minimum(q - self.leg.lower, self.leg.upper - q).min(axis=-1)
        return nearest

    def last_points(self, q: Array) -> tuple[Array, Array]:
        """Return the second axis' point and the last axis' point [m]. Shape (..., 3) each."""
        last = len(self.points) - 1
        return self._point(1, q), self._point(last, q)

    def _point(self, index: int, q: Array) -> Array:
        """Return where a point of the leg's axes is [m]."""
        axes, origins = self.leg.axes[:index], self.points[:index]
        return SerialChain.of(axes, origins, self.points[index]).forward(q[..., :index])

    def regularity(self, jacobian: Array) -> Array:
        """Return the Jacobian's volume relative to the links' lengths: 0 is singular. (...)."""
        if jacobian.shape[-1] == 3:
            volume: Array = np.abs(np.linalg.det(jacobian))
        else:
            square = np.swapaxes(jacobian, -1, -2) @ jacobian
            volume = np.sqrt(np.maximum(np.linalg.det(square), 0.0))
        return volume / (self.length * self.links)


def standing_score(measure: LegMeasure, q: Array, clearance: Array) -> Array:
    """Return the score of postures (N, J) without a look at walking; clearance (N,) [m]."""
    second, last = measure.last_points(q)
    tip = measure.chain.forward(q)
    link = last - tip
    cos = link[:, 2] / np.linalg.norm(link, axis=1)
    lean = np.arccos(np.clip(cos, -1.0, 1.0))
    free = clearance / (CLEARANCE_SHARE * measure.length)
    score = -((lean / LEAN_SCALE) ** 2) + np.tanh(free)
    if q.shape[1] == 2:
        return np.asarray(score)
    along = tip - second
    bend = np.cross(np.cross(last - second, along), along)[:, 2]  # against up where knee is up
    down = bend >= 0.0
    away = tip - measure.points[0]
    folded = ((last - second) * away)[:, :2].sum(axis=1) < 0.0
    return np.asarray(score - KNEE_DOWN * down - FOLDED * folded)


def walking_score(measure: LegMeasure, q: Array) -> Array:
    """Return what postures (N, J) are worth in a walk. Shape (N,).

    Looked at: where the foot stands, half a stroke before and behind it, and lifted.
    """
    stroke, lift = STROKE_SHARE * measure.length, LIFT_SHARE * measure.length
    moves = np.array([[0.5, 0, 0], [-0.5, 0, 0], [0, 0, 0]]) * stroke
    moves[2, 2] = lift
    tip = measure.chain.forward(q)
    targets = (tip[None] + moves[:, None]).reshape(-1, 3)
    moved, miss = towards(measure.chain, np.tile(q, (3, 1)), targets, measure.length)
    everywhere = np.vstack([q, moved]).reshape(4, *q.shape)
    margin = measure.margin(everywhere).min(axis=0)
    jacobian = measure.chain.jacobian(everywhere)
    score = measure.regularity(jacobian).min(axis=0)
    score += np.tanh(np.maximum(margin, 0.0) / LIMIT_SCALE)
    score += BEYOND_LIMIT * np.minimum(margin, 0.0) / LIMIT_SCALE
    if q.shape[1] == 3:
        missed = (miss > 1e-6 * measure.length).reshape(3, -1).sum(axis=0)
        score = score - OUT_OF_REACH * missed
    return np.asarray(score)


def crossing_legs(legs: Sequence[LegFrame], angles: Sequence[Array]) -> list[tuple[int, int]]:
    """Return pairs of legs whose lines from hip to foot cross, seen from above.

    Also with one foot half a stroke before where it stands and the other half a stroke behind.
    """
    hips, tips, strokes = [], [], []
    for leg, q in zip(legs, angles, strict=True):
        measure = LegMeasure.of(leg)
        hips.append(measure.points[0][:2])
        tips.append(measure.chain.forward(q)[:2])
        strokes.append(np.array([0.5 * STROKE_SHARE * measure.length, 0.0]))
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
