"""Knots of the start of a walk and of its first steady cycle, from which any length is made.

The knots do not depend on how long the walk is: those of a shorter one begin those of a longer one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.control.body_path import EVENT_SEPARATION_CYCLES, TRANSIENT_CYCLES
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.leg_group import LegGroup

if TYPE_CHECKING:
    from hexapod_pin.control.body_motion import BodyMotion

STEADY_CYCLES = TRANSIENT_CYCLES + 1
"""Whole cycles of the longest table: those to start, and one steady cycle."""

MAX_KNOT_SPACING = 0.01
"""Largest spacing of the knots [s]."""

MAX_KNOT_ERROR = 1e-6
"""Largest error of the cubic between knots, in joint angle [rad]."""

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


def sample_knots(six: LegGroup, path: FootPath, time: Array, near: Array | None = None) -> Knots:
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
    v = six.kinematics.rates(v_BF[:, ::2], q[:, ::2])
    eighth = 0.125 * np.diff(time)[:, None]
    cubic = 0.5 * (q[:, :-1:2] + q[:, 2::2]) + eighth * (v[:, :-1] - v[:, 1:])
    return Knots(
        time=time,
        q=six.joint_rows(q[:, ::2], six.posture),
        v=six.joint_rows(v, 0.0),
        error=np.abs(cubic - q[:, 1::2]).max(axis=(0, 2)),
    )


def knot_times(events: Array, spacing: float | Array) -> tuple[Array, NDArray[np.intp]]:
    """Part each span between events evenly, into intervals of at most `spacing`.

    Args:
        events: ascending [s]. Shape (S + 1,).
        spacing: of all spans, or of each one [s]. A number or shape (S,).

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
        path: what their feet follow.
        spacing: largest spacing of the knots [s].
        events: where the spans begin, and the end of the last [s]. Shape (S + 1,).
        first: the first knot of each span, and the end of the last. Shape (S + 1,).
        knots: of all spans.
        steady: the first span that repeats.
    """

    six: LegGroup
    path: FootPath
    spacing: float
    events: Array
    first: NDArray[np.intp]
    knots: Knots
    steady: int

    def spans_before(self, limit: float) -> tuple[int, float]:
        """Return how many spans end before a time, and where the last one does [s]."""
        spans = max(0, int(np.searchsorted(self.events, limit)) - 1)
        if spans < len(self.events) - 1:
            return spans, float(self.events[spans])
        period = self.path.gait.cycle_time
        cycles = int((limit - self.events[self.steady]) / period)
        events = self.events[self.steady : -1] + cycles * period
        more = max(0, int(np.searchsorted(events, limit)) - 1)
        return self.steady + cycles * len(events) + more, float(events[more])

    def rows(self, spans: int, begun: int = 0) -> tuple[NDArray[np.intp], Array]:
        """Return the knots of the first spans and of their end: rows of `knots`, and times [s].

        `begun`: spans that are left out at the start.
        """
        begin, end = self.first[self.steady], self.first[-1]
        knot = np.arange(self._first_knot(begun), self._first_knot(spans) + 1)
        row = np.where(knot < begin, knot, begin + (knot - begin) % (end - begin))
        later = (knot - row) // (end - begin)
        return row, self.knots.time[row] + later * self.path.gait.cycle_time

    def _first_knot(self, span: int) -> int:
        """Return the number of the first knot of a span, of all of a walk."""
        if span < self.steady:
            return int(self.first[span])
        cycles, more = divmod(span - self.steady, len(self.events) - 1 - self.steady)
        length = self.first[-1] - self.first[self.steady]
        return int(cycles * length + self.first[self.steady + more])


@lru_cache(maxsize=KEPT_TABLES)
def knot_table(six: LegGroup, gait: Gait, motion: BodyMotion | None = None) -> KnotTable:
    """Return the knots of a walk through its first event after STEADY_CYCLES cycles.

    The spacing is halved until the cubics between the knots are close enough.

    Args:
        six: the legs.
        gait: the gait.
        motion: constant offsets of the trunk; None: none.

    Raises:
        ReachError: a leg cannot follow.
    """
    six = six.along(gait)
    period, path = gait.cycle_time, FootPath.of(six, gait, motion=motion)
    whole = period * (np.array([TRANSIENT_CYCLES, STEADY_CYCLES]) - EVENT_SEPARATION_CYCLES)
    events = np.append(0.0, path.events((STEADY_CYCLES + 2) * period))
    steady, last = np.searchsorted(events, whole)
    events = events[: last + 1]
    spacing, first, knots = fine_knots(six, path, events, MAX_KNOT_SPACING)
    return KnotTable(six, path, spacing, events, first, knots, int(steady))


def fine_knots(
    six: LegGroup, path: FootPath, events: Array, spacing: float, near: Array | None = None
) -> tuple[float, NDArray[np.intp], Knots]:
    """Return knots between events, the spacing [s] halved until cubics between them are close.

    Args:
        six: the legs.
        path: what their feet follow.
        events: ascending [s]. Shape (S + 1,).
        spacing: the first to try [s].
        near: as of `sample_knots`.

    Returns:
        The spacing [s], where each event is among the knots, shape (S + 1,), and the knots.

    Raises:
        ReachError: a leg cannot follow.
    """
    while True:
        time, first = knot_times(events, spacing)
        knots = sample_knots(six, path, time, near)
        if knots.error.max() <= 0.5 * MAX_KNOT_ERROR:
            return spacing, first, knots
        spacing *= 0.5
