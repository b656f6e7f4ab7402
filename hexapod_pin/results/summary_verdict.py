"""Does it walk? As far as a summary can say, which keeps no samples."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hexapod_pin.results.planned_turn import gait_turn_rate
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.walk_fall import SUNK, SUNK_WORDS, TIPPED, TIPPED_WORDS, Fall
from hexapod_pin.results.walk_verdict import why_it_does_not_walk
from hexapod_pin.results.walked_way import WalkedWay


@dataclass(frozen=True)
class SummaryVerdict:
    """Whether a summary is that of a walk.

    Attributes:
        walks: whether it walks as `WalkVerdict.walks` says; None where it cannot be judged.
        reason: why it does not walk, or cannot be judged; empty where it walks.
        speed_share: way over planned way [-]; NaN where none was planned.
        turn_share: yaw over planned yaw [-]; NaN where less than 2 degrees were planned.
    """

    walks: bool | None
    reason: str
    speed_share: float
    turn_share: float


def summary_verdict(summary: Summary) -> SummaryVerdict:
    """Return whether a run walks as planned, judged over its whole cycles by its summary.

    The rule is that of `walk_verdict`: at least 80 % of the planned way and yaw, no fall, no
    contact of the trunk. Of falls a summary shows those that last into its window: a trunk that
    leans by 45 degrees, against gravity; on level ground, one that is below half of its height at
    the start; and feet that are never loaded. Without a whole cycle of a gait nothing is judged.
    """
    touches = [event for event in summary.events if event.kind == "trunk-contact"]
    way = summary_way(summary)
    reason = why_it_does_not_walk(way, summary_fall(summary), touches)
    walks: bool | None = not reason
    if not reason and _needs_cycle(summary):
        walks, reason = None, "the run holds no whole cycle of steady walking: not judged"
    return SummaryVerdict(walks, reason, _number(way.speed_share), _number(way.turn_share))


def summary_way(summary: Summary) -> WalkedWay:
    """Return way and yaw over the whole cycles of a summary, planned and made; nil without."""
    meta, distance = summary.meta, summary.distance
    if distance is None:
        return WalkedWay(summary.begin, summary.end, None, 0.0, 0.0, 0.0, 0.0)
    time, cycles = summary.time, summary.cycles or 1
    return WalkedWay(
        summary.begin, summary.end, cycles,
        planned_way=float(meta.get("nominal_speed") or 0.0) * time, way=distance * cycles,
        planned_turn=gait_turn_rate(meta) * time, turn=(summary.turn_rate or 0.0) * time,
    )  # fmt: skip


def summary_fall(summary: Summary) -> Fall | None:
    """Return a fall that shows in the window of a summary; its time is that of the window's end."""
    if not summary.foot_names or math.isnan(summary.height_min):
        return None
    start: Mapping[str, Any] | None = summary.meta.get("level_start")
    lean = max(abs(summary.roll_peak), abs(summary.pitch_peak))
    if lean > TIPPED:
        return Fall(summary.end, TIPPED_WORDS)
    if start is not None:
        height = summary.height_min - start["ground"]
        if height < SUNK * (start["trunk"] - start["ground"]):
            return Fall(summary.end, SUNK_WORDS)
    feet = summary.loaded_time
    return Fall(summary.end, "no foot is on the ground") if feet.size and not feet.any() else None


def _needs_cycle(summary: Summary) -> bool:
    return summary.meta.get("cycle_time") is not None and not summary.cycles


def _number(share: float | None) -> float:
    return math.nan if share is None else share
