"""Knots of a walk of any length: joint angles and rates, dense enough for cubics between them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.foot_path import EVENT_SEPARATION_CYCLES, FootPath
from hexapod_pin.control.knot_table import (
    STEADY_CYCLES,
    Knots,
    KnotTable,
    knot_table,
    knot_times,
    sample_knots,
)
from hexapod_pin.control.six_legs import SixLegs

MAX_KNOT_SPACING = 0.01
"""Largest spacing of the knots [s]."""

MAX_KNOT_ERROR = 1e-6
"""Largest error of the cubic between knots, in joint angle [rad]."""

KEPT_ENDS = 64
"""How many ends of walks are remembered, each less than a span between two events."""


def walk_knots(six: SixLegs, path: FootPath, end: float) -> tuple[Array, Array, Array]:
    """Return knot times (K,) [s], joint angles (K, n) [rad] and rates (K, n) [rad/s].

    The spacing is halved until the cubics between the knots are close enough.

    Args:
        six: the legs.
        path: what their feet follow.
        end: duration of the walk [s].

    Raises:
        ReachError: a leg cannot follow.
    """
    spacing = MAX_KNOT_SPACING
    while (knots := _knots(six, path, end, spacing)) is None:
        spacing *= 0.5
    for array in (knots.time, knots.q, knots.v):
        array.setflags(write=False)  # so that a trajectory keeps them without copying
    return knots.time, knots.q, knots.v


def _knots(six: SixLegs, path: FootPath, end: float, spacing: float) -> Knots | None:
    """Return the knots at one spacing, from the table and what is left; None if it is too wide."""
    period = path.gait.cycle_time
    limit = min(end - EVENT_SEPARATION_CYCLES * period, path.steady_until)
    cycles = int(np.clip(np.ceil(limit / period), 1, STEADY_CYCLES))
    table = knot_table(six, path.gait, spacing, cycles)
    spans, begin = table.spans_before(limit)
    if table.error[:spans].max(initial=0.0) > 0.5 * MAX_KNOT_ERROR:
        return None
    row, time = table.rows(spans)
    count, previous = len(row), int(row[-1]) if len(row) else None
    if path.stop_at is None:
        rest = _last_knots(table, previous, begin, end)
    else:
        rest = _stopping_knots(table, previous, begin, end, path.stop_at)
    if rest.error.max() > 0.5 * MAX_KNOT_ERROR:
        return None
    q, v = (np.empty((count + len(rest.time), len(six.posture))) for _ in range(2))
    for whole, values in ((q, table.knots.q), (v, table.knots.v)):
        np.take(values, row, axis=0, out=whole[:count], mode="clip")  # "raise" makes a copy
    q[count:], v[count:] = rest.q, rest.v
    error = np.append(table.error[:spans], rest.error)
    return Knots(np.append(time, rest.time), q, v, error)


@lru_cache(maxsize=KEPT_ENDS)
def _last_knots(table: KnotTable, previous: int | None, begin: float, end: float) -> Knots:
    """Return the knots after the last whole span of a walk that goes on.

    Args:
        table: the knots of the whole spans.
        previous: row of the knot before the first to return; None at the start.
        begin: end of the last whole span [s].
        end: duration of the walk [s].
    """
    path = FootPath(table.gait, table.six.neutral_feet)
    time = _times(table, path, begin, end)
    return sample_knots(table.six, path, time, _posture_before(table, previous))


def _stopping_knots(
    table: KnotTable, previous: int | None, begin: float, end: float, stop_at: float
) -> Knots:
    """Return the knots as `_last_knots` of a walk that stops, and stands from then on."""
    path = FootPath(table.gait, table.six.neutral_feet, stop_at=stop_at)
    time = _times(table, path, begin, end)
    moving = max(2, int(np.searchsorted(time, stop_at)) + 1)
    knots = sample_knots(table.six, path, time[:moving], _posture_before(table, previous))
    standing = max(0, len(time) - moving)
    q, v = (np.concatenate([x, np.repeat(x[-1:], standing, axis=0)]) for x in (knots.q, knots.v))
    return Knots(time, q, v, knots.error)


def _times(table: KnotTable, path: FootPath, begin: float, end: float) -> Array:
    """Return the knot times from `begin` to `end` [s]."""
    events = np.array([begin, *path.events(end, begin), end])
    return knot_times(events, table.spacing)[0]


def _posture_before(table: KnotTable, previous: int | None) -> Array | None:
    """Return the joint angles of a row of the table [rad]; None before the first."""
    return None if previous is None else table.knots.q[previous]
