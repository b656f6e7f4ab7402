"""Knots of a walk of any length: joint angles and rates, dense enough for cubics between them."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.foot_path import EVENT_SEPARATION_CYCLES, FootPath
from hexapod_pin.control.knot_table import (
    MAX_KNOT_ERROR,
    MAX_KNOT_SPACING,
    Knots,
    fine_knots,
    knot_table,
    knot_times,
    sample_knots,
)
from hexapod_pin.control.planning_progress import tell_planned
from hexapod_pin.control.six_legs import SixLegs
from hexapod_pin.control.walk_schedule import TRANSIENT_CYCLES
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.control.body_motion import BodyMotion
    from hexapod_pin.control.gait import Gait

KEPT_STOPS = 16
"""How many ends of walks that stop are remembered."""

LEAST_EVENTS = 4
"""Of the foot paths in a cycle: two groups of legs that lift and touch down."""

MOST_KNOTS = 5e7
"""Most knots planned at once: 15 GB for 18 joints."""

BLOCK_KNOTS = 20_000
"""Knots of a walk that does not repeat are made in blocks of about this number."""


def walk_knots(
    six: SixLegs, path: FootPath, end: float, since: float = 0.0
) -> tuple[Array, Array, Array]:
    """Return knot times (K,) [s], joint angles (K, n) [rad] and rates (K, n) [rad/s].

    They go on to the first event of the foot paths that is not before the end, or to the stop: the
    knots of a shorter walk are the first ones of a longer walk.

    Args:
        six: the legs.
        path: what their feet follow.
        end: duration of the walk [s].
        since: of a walk whose cycles repeat: the knots begin at the last event of the foot paths
            not after this time, or where it prepares to stop [s].

    Raises:
        ReachError: a leg cannot follow.
        ParameterError: more knots than `MOST_KNOTS`.
    """
    _require_few(end - since, path.gait.cycle_time)
    knots = _repeated(six, path, end, since) if path.periodic else _unrepeated(six, path, end)
    for array in knots:
        array.setflags(write=False)  # so that a trajectory keeps them without copying
    return knots


def _require_few(length: float, period: float) -> None:
    """Refuse a plan too long to be made at once; a cycle has a knot at each event at least."""
    longest = MOST_KNOTS * min(MAX_KNOT_SPACING, period / LEAST_EVENTS)
    if length > longest:
        raise ParameterError(
            "duration", length, f"at most {longest:.3g} s planned at once",
            "A longer walk is simulated from checkpoint to checkpoint (initial=trace.checkpoint); "
            "`simulate` plans one whose cycles repeat in parts.",
        )  # fmt: skip


def _repeated(six: SixLegs, path: FootPath, end: float, since: float) -> tuple[Array, Array, Array]:
    """Return the knots of a walk whose cycles repeat: from the table, and those of its stop."""
    table = knot_table(six, path.gait, path.motion)
    period = path.gait.cycle_time
    spans = table.spans_before(end - EVENT_SEPARATION_CYCLES * period)[0] + 1
    begun = table.spans_before(since)[0]
    if path.stop_at is None:
        row, time = table.rows(spans, begun)
        return time, table.knots.q[row], table.knots.v[row]
    steady, begin = table.spans_before(path.steady_until)
    row, time = table.rows(min(spans, steady), min(begun, steady))
    if spans <= steady:
        return time, table.knots.q[row], table.knots.v[row]
    shift = max(0, int(path.steady_until / period) - TRANSIENT_CYCLES - 1) * period
    rest = _stop_knots(
        six, path.gait, path.motion, path.stop_at - shift, begin - shift, int(row[-1])
    )
    both = [(table.knots.q, rest.q), (table.knots.v, rest.v)]
    q, v = (np.concatenate([first[row], last[1:]]) for first, last in both)
    return np.append(time, rest.time[1:] + shift), q, v


@lru_cache(maxsize=KEPT_STOPS)
def _stop_knots(
    six: SixLegs, gait: Gait, motion: BodyMotion | None, stop_at: float, begin: float, row: int
) -> Knots:
    """Return the knots from an event before a walk prepares to stop until it stands.

    Args:
        six: the legs.
        gait: the gait.
        motion: constant offsets of the trunk; None: none.
        stop_at: [s].
        begin: the first knot [s].
        row: of the table, with the joint angles near those of the first knot.

    Raises:
        ReachError: a leg cannot follow.
    """
    table = knot_table(six, gait, motion)
    path = FootPath.of(six, gait, stop_at=stop_at, motion=motion)
    events = np.array([begin, *path.events(stop_at, begin), stop_at])
    return fine_knots(six, path, events, table.spacing, table.knots.q[row])[2]


def _unrepeated(six: SixLegs, path: FootPath, end: float) -> tuple[Array, Array, Array]:
    """Return the knots of a walk that does not repeat, each span as dense as it needs."""
    period = path.gait.cycle_time
    events = np.append(0.0, path.events(end + 2.0 * period))
    last = max(1, int(np.searchsorted(events, end - EVENT_SEPARATION_CYCLES * period)))
    events = events[: last + 1]
    path = path.solved_until(float(events[-1]))
    share = max(1, int(BLOCK_KNOTS * MAX_KNOT_SPACING * last / events[-1]))
    blocks: list[Knots] = []
    for first in range(0, last, share):
        tell_planned(first / last)
        near = blocks[-1].q[-1] if blocks else None
        blocks.append(_span_knots(six, path, events[first : first + share + 1], near))
    columns = []
    for name in ("time", "q", "v"):
        parts = [getattr(block, name)[:-1] for block in blocks]
        columns.append(np.concatenate([*parts, getattr(blocks[-1], name)[-1:]]))
    return columns[0], columns[1], columns[2]


def _span_knots(six: SixLegs, path: FootPath, events: Array, near: Array | None) -> Knots:
    """Return the knots between some events, spacing halved in the spans that need it."""
    spacing = np.full(len(events) - 1, MAX_KNOT_SPACING)
    while True:
        time, first = knot_times(events, spacing)
        knots = sample_knots(six, path, time, near)
        wide = np.maximum.reduceat(knots.error, first[:-1]) > 0.5 * MAX_KNOT_ERROR
        if not wide.any():
            return knots
        spacing[wide] *= 0.5
