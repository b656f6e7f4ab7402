"""Knots of the start of a walk and of its first steady cycle, from which any length is made."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.control.foot_path import EVENT_SEPARATION_CYCLES, TRANSIENT_CYCLES, FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.six_legs import SixLegs
from hexapod_pin.robot.leg_velocity import joint_rates

STEADY_CYCLES = TRANSIENT_CYCLES + 1
"""Whole cycles of the longest table: those to start, and one steady cycle."""

KEPT_TABLES = 16
"""How many tables are remembered (0.2 MB each for a gait of 2.4 s)."""

SPACING_TOLERANCE = 1e-9
"""Share of a spacing by which a span may be longer than a whole number of them."""


@dataclass(frozen=True, eq=False)
class Knots:
    """Joint angles and rates at K times, with the error of the cubics between them.

    Attributes:
        time: [s]. Shape (K,).
        q: joint angles, `Robot.joint_names` order [rad]. Shape (K, n).
        v: joint rates [rad/s]. Shape (K, n).
        error: how far the cubic of each interval misses its mid-point [rad]. Shape (K - 1,).
    """

    time: Array
    q: Array
    v: Array
    error: Array


def sample_knots(six: SixLegs, path: FootPath, time: Array, near: Array | None = None) -> Knots:
    """Return the knots at given times.

    Args:
        six: the legs.
        path: what their feet follow.
        time: [s]. Shape (K,), K >= 2.
        near: reference for the first joint angles, `Robot.joint_names` order; the standing posture
            if None [rad]. Shape (n,).

    Raises:
        ReachError: a leg cannot follow.
    """
    both = np.empty(2 * len(time) - 1)
    both[::2], both[1::2] = time, 0.5 * (time[:-1] + time[1:])
    p_BF, v_BF = six.foot_motion(path, both)
    q = six.kinematics.inverse(p_BF, None if near is None else six.leg_rows(near))
    v = joint_rates(six.kinematics.jacobian(q[:, ::2]), v_BF[:, ::2])
    eighth = 0.125 * np.diff(time)[:, None]
    cubic = 0.5 * (q[:, :-1:2] + q[:, 2::2]) + eighth * (v[:, :-1] - v[:, 1:])
    return Knots(
        time=time,
        q=six.joint_rows(q[:, ::2], six.posture),
        v=six.joint_rows(v, 0.0),
        error=np.abs(cubic - q[:, 1::2]).max(axis=(0, 2)),
    )


def knot_times(events: Array, spacing: float) -> tuple[Array, NDArray[np.intp]]:
    """Part each span between events evenly, into intervals of at most `spacing`.

    Args:
        events: ascending [s]. Shape (S + 1,).
        spacing: [s].

    Returns:
        The times, the last event included [s], shape (K,), and where each event is among them,
        shape (S + 1,).
    """
    length = np.diff(events)
    pieces = np.ceil(length / spacing - SPACING_TOLERANCE).astype(int)
    first = np.concatenate([[0], np.cumsum(pieces)])
    within = np.arange(first[-1]) - np.repeat(first[:-1], pieces)
    times = within * np.repeat(length / pieces, pieces) + np.repeat(events[:-1], pieces)
    return np.append(times, events[-1]), first


@dataclass(frozen=True, eq=False)
class KnotTable:
    """Knots of a walk without end, span by span between the events of its foot paths.

    Spans from `steady` on repeat: span s + (S - steady) is span s one cycle later.

    Attributes:
        six: the legs.
        gait: the gait.
        spacing: largest spacing of the knots [s].
        events: where the spans begin, and the end of the last [s]. Shape (S + 1,).
        first: the first knot of each span, and the end of the last. Shape (S + 1,).
        knots: of all spans.
        error: largest `Knots.error` in each span [rad]. Shape (S,).
        steady: the first span that repeats; S in a table that ends before one cycle has.
    """

    six: SixLegs
    gait: Gait
    spacing: float
    events: Array
    first: NDArray[np.intp]
    knots: Knots
    error: Array
    steady: int

    def spans_before(self, limit: float) -> tuple[int, float]:
        """Return how many spans end before a time, and where the last one does [s]."""
        spans = max(0, int(np.searchsorted(self.events, limit)) - 1)
        if spans < len(self.error) or self.steady == len(self.error):
            return spans, float(self.events[spans])
        cycles = int((limit - self.events[self.steady]) / self.gait.cycle_time)
        events = self.events[self.steady : -1] + cycles * self.gait.cycle_time
        more = max(0, int(np.searchsorted(events, limit)) - 1)
        return self.steady + cycles * len(events) + more, float(events[more])

    def rows(self, spans: int) -> tuple[NDArray[np.intp], Array]:
        """Return the knots of the first spans: rows of `knots`, and their times [s]."""
        begin, end = self.first[self.steady], self.first[-1]
        if spans <= len(self.error):
            row = np.arange(self.first[spans])
            return row, self.knots.time[row]
        cycles, more = divmod(spans - self.steady, len(self.error) - self.steady)
        count = cycles * (end - begin) + self.first[self.steady + more]
        knot = np.arange(count)
        row = np.where(knot < begin, knot, begin + (knot - begin) % (end - begin))
        return row, self.knots.time[row] + (knot - row) // (end - begin) * self.gait.cycle_time


@lru_cache(maxsize=KEPT_TABLES)
def knot_table(six: SixLegs, gait: Gait, spacing: float, cycles: int) -> KnotTable:
    """Return the knots of a walk through its first event after some whole cycles.

    Args:
        six: the legs.
        gait: the gait.
        spacing: largest spacing of the knots [s].
        cycles: from 1 to STEADY_CYCLES; only the last has spans that repeat.

    Raises:
        ReachError: a leg cannot follow.
    """
    period, path = gait.cycle_time, FootPath(gait, six.neutral_feet)
    whole = period * (np.array([TRANSIENT_CYCLES, cycles]) - EVENT_SEPARATION_CYCLES)
    events = np.append(0.0, path.events((cycles + 2) * period))
    steady, last = np.searchsorted(events, whole)
    events = events[: last + 1]
    time, first = knot_times(events, spacing)
    knots = sample_knots(six, path, time)
    error = np.maximum.reduceat(knots.error, first[:-1])
    return KnotTable(
        six=six,
        gait=gait,
        spacing=spacing,
        events=events,
        first=first,
        knots=knots,
        error=error,
        steady=int(steady) if cycles == STEADY_CYCLES else len(error),
    )
