"""The closed loop of foot control and a standing robot from tick to tick, as one matrix."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.control.foot_control.linear_law import LinearLaw
    from hexapod_pin.control.foot_control.stance_model import StanceModel

NEUTRAL = 1e-6
"""An eigenvalue nearer to 1 than this is one: integrals that no reading reaches, a trunk that no
spring holds over creeping feet. At 200 Hz what grows slower takes 5000 s to grow by e."""

SAME_RANK = 1e-8
"""Singular values of the set-points' directions below this share of the largest are rounding."""

SAME_TIME = 1e-9
"""Share of a period by which a delay may miss a tick and still be at it."""


@dataclass(frozen=True, eq=False)
class LinearLoop:
    """A standing robot between ticks, its set-points ramped; sensor and command delay in one.

    Only their sum matters to a loop whose plan stands. A delay of n ticks and a part r of one is
    exact: what is read at t - d, within a tick, acts n + 1 ticks after that tick.

    Attributes:
        stance: the robot.
        period: between ticks [s].
        delay: from a measurement until its command acts [s].
        whole: (x, q_ref, q_ref') at the end of a tick by those at its begin. Shape (S, S).
        part: the same up to the time of measurement in the tick.
        waits: ticks between the tick of a measurement and that of its command.
    """

    stance: StanceModel
    period: float
    delay: float
    whole: Array
    part: Array
    waits: int

    @classmethod
    def of(cls, stance: StanceModel, period: float, delay: float) -> LinearLoop:
        """Discretise a stance, exactly for set-points on ramps."""
        ticks = math.floor(delay / period + SAME_TIME)
        rest = max(0.0, delay - ticks * period)
        states, joints = 2 * stance.size, len(stance.kp)
        rates = np.zeros((states + 2 * joints,) * 2)
        rates[:states] = np.hstack([stance.state_matrix, stance.input_matrix])
        rates[states : states + joints, states + joints :] = np.eye(joints)
        from scipy.linalg import expm

        whole = expm(period * rates)
        at_tick = rest <= SAME_TIME * period
        part = whole if at_tick else expm((period - rest) * rates)
        return cls(stance, period, delay, whole, part, ticks + 1)

    def matrix(self, law: LinearLaw) -> Array:
        """Return the closed loop from tick to tick.

        State: x and v of the robot, then along the directions that the law uses the set-points
        now and of the commands under way, oldest first, then the memory.
        """
        ways = _directions(np.hstack([law.set_point, law.through]))
        whole, part = self._along(self.whole, ways), self._along(self.part, ways)
        states, rank = 2 * self.stance.size, ways.shape[1]
        queue = slice(states + rank, states + rank * (1 + self.waits))
        begin = queue.stop
        size = begin + law.size
        reading = np.zeros((law.reading.shape[1], size))
        reading[:, : states + 2 * rank] = self._reading(law, part)
        found = np.zeros((size, size))
        found[:states, : states + 2 * rank] = whole[:states]
        found[states : queue.stop - rank, states + rank : queue.stop] = np.eye(rank * self.waits)
        last = slice(queue.stop - rank, queue.stop)
        found[last] = ways.T @ law.through @ reading
        found[last, begin:] += ways.T @ law.set_point
        found[begin:] = law.reading @ reading
        found[begin:, begin:] += law.memory
        return found

    def _along(self, motion: Array, ways: Array) -> Array:
        """Return (x, q_ref, q_ref') by (x, set-points now, at the tick's end) along directions."""
        states, rank = 2 * self.stance.size, ways.shape[1]
        begin = np.zeros((len(motion), states + 2 * rank))
        begin[:states, :states] = np.eye(states)
        joints = len(ways)
        now, rate = slice(states, states + joints), slice(states + joints, None)
        begin[now, states : states + rank] = ways
        begin[rate, states : states + rank] = -ways / self.period
        begin[rate, states + rank :] = ways / self.period
        return motion @ begin

    def _reading(self, law: LinearLaw, part: Array) -> Array:
        """Return the readings of a tick by its state, with the set-points it begins and ends at."""
        outputs = self.stance.outputs()
        rows = [np.hstack(outputs[name]) for name in law.fields]
        joined = np.vstack(rows) if rows else np.zeros((0, len(part)))
        return np.asarray(joined @ part)

    def radius(self, law: LinearLaw, drift_time: float = math.inf) -> float:
        """Return the largest |eigenvalue| of the loop, neutral ones aside; below 1: stable.

        Args:
            law: the controller.
            drift_time: what grows without swinging, slower than by e in this time, is neutral [s].
        """
        eigenvalues = np.linalg.eigvals(self.matrix(law))
        least = max(NEUTRAL, math.expm1(self.period / drift_time))
        drifts = (eigenvalues.imag == 0.0) & (eigenvalues.real > 1.0 - NEUTRAL)
        neutral = drifts & (eigenvalues.real < 1.0 + least)
        neutral |= np.abs(eigenvalues - 1.0) < NEUTRAL
        return float(np.abs(eigenvalues[~neutral]).max(initial=0.0))


def _directions(columns: Array) -> Array:
    """Return an orthonormal basis of what columns span. Shape (n, rank)."""
    size = np.linalg.norm(columns, axis=0)
    unit = columns[:, size > 0.0] / size[size > 0.0]
    if not unit.size:
        return np.zeros((len(columns), 0))
    left, values, _ = np.linalg.svd(unit, full_matrices=False)
    return np.asarray(left[:, values > SAME_RANK * values[0]])
