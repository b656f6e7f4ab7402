"""Whether a run walks, as far as its summary shows it: the verdict of a sweep's cases."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hexapod_pin.results.summary import Summary
from hexapod_pin.results.travelled_path import (
    SUNK,
    SUNK_TEXT,
    TIPPED,
    TIPPED_TEXT,
    Fall,
    TravelledPath,
    push_offset,
    thrown_text,
)
from hexapod_pin.results.walk_causes import dragging, legs_lost, slip_per_metre
from hexapod_pin.results.walk_verdict import why_it_does_not_walk


@dataclass(frozen=True)
class SummaryVerdict:
    """Whether a summary is that of a walk.

    Attributes:
        walks: as `WalkVerdict.walks`; None where it cannot be judged.
        reason: why it does not walk, or cannot be judged; empty where it walks.
        speed_share: distance over planned distance [-]; NaN where none was planned.
        turn_share: yaw over planned yaw [-]; NaN where less than 2 degrees were planned.
    """

    walks: bool | None
    reason: str
    speed_share: float
    turn_share: float


def summary_verdict(summary: Summary, stance: float = math.nan) -> SummaryVerdict:
    """Return whether a run walks as planned, judged over its whole cycles by its summary.

    The rule is that of `walk_verdict`: at least 80 % of the planned distance and yaw, no fall, no
    contact of the trunk, no foot that is dragged, not thrown off its track by a push. Of falls a
    summary shows those that last into its window: a trunk that leans by 45 degrees, against
    gravity; on level ground, one that is below half of its height at the start; and feet that are
    never loaded. Without a whole cycle of a gait nothing is judged.

    Args:
        summary: of the run.
        stance: distance of the feet farthest apart as the robot stands [m], by which a push is
            judged; NaN: it is not.
    """
    touches = [event for event in summary.events if event.kind == "trunk-contact"]
    path = summary_path(summary)
    reason = why_it_does_not_walk(path, summary_fall(summary), touches)
    reason = reason or thrown_text(push_offset(summary), stance)
    lost = len(legs_lost(summary.run, summary.end))
    reason = reason or dragging(slip_per_metre(summary, summary.run.walk.speed), lost)
    walks: bool | None = not reason
    if not reason and summary.run.walk.cycle_time is not None and not summary.cycles:
        walks, reason = None, "the run holds no whole cycle of steady walking: not judged"
    return SummaryVerdict(walks, reason, _number(path.speed_share), _number(path.turn_share))


def summary_path(summary: Summary) -> TravelledPath:
    """Return distance and yaw over the whole cycles of a summary, planned and made; 0 without."""
    walk, distance = summary.run.walk, summary.distance
    if distance is None:
        return TravelledPath(summary.start, summary.end, None, 0.0, 0.0, 0.0, 0.0)
    time, cycles = summary.window_time, summary.cycles or 1
    return TravelledPath(
        summary.start, summary.end, cycles,
        planned_distance=walk.speed * time,
        travelled_distance=distance * cycles,
        planned_turn=walk.turn_rate * time, turn=(summary.measured_turn_rate or 0.0) * time,
    )  # fmt: skip


def summary_fall(summary: Summary) -> Fall | None:
    """Return a fall that shows in the window of a summary; its time is that of the window's end."""
    if not summary.foot_names or math.isnan(summary.height_min):
        return None
    start = summary.run.level_start
    lean = max(abs(summary.roll_peak), abs(summary.pitch_peak))
    if lean > TIPPED:
        return Fall(summary.end, TIPPED_TEXT)
    if start is not None and start.trunk > start.ground:  # else its origin tells nothing
        height = summary.height_min - start.ground
        if height < SUNK * (start.trunk - start.ground):
            return Fall(summary.end, SUNK_TEXT)
    feet = summary.loaded_time
    return Fall(summary.end, "no foot is on the ground") if feet.size and not feet.any() else None


def _number(share: float | None) -> float:
    return math.nan if share is None else share
