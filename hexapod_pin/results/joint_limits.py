"""How often and how long the joints of a run were at their limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hexapod_pin.results.event import Event


@dataclass(frozen=True)
class JointLimits:
    """What one joint met in a whole run, by its accepted steps.

    Attributes:
        joint: its name.
        limit_count: times its torque limit was reached.
        limit_time: time at the limit [s].
        stop_count: times it ran into a stop.
    """

    joint: str
    limit_count: int
    limit_time: float
    stop_count: int


def joint_limits(names: Sequence[str], meta: Mapping[str, Any]) -> tuple[JointLimits, ...]:
    """Return the limits of all joints that a run's `meta` tells of; none of older runs."""
    drive = meta.get("drive")
    if drive is None:
        return ()
    rows = zip(names, drive["limit_count"], drive["limit_time"], drive["stop_count"], strict=True)
    return tuple(JointLimits(name, int(n), float(t), int(stops)) for name, n, t, stops in rows)


def events_text(events: Sequence[Event], limits: Sequence[JointLimits]) -> list[str]:
    """Return one line for the trunk's contact with the ground and one for limits, where any."""
    lines = []
    if events:
        first = events[0]
        x, y, z = first.place
        more = f"; {len(events)} contacts in all" if len(events) > 1 else ""
        lines.append(
            f"the trunk touched the ground at {first.time:.4g} s: {first.what} at "
            f"({x:.3f}, {y:.3f}, {z:.3f}) m{more}"
        )
    saturated = [row for row in limits if row.limit_count]
    if saturated:
        most = max(saturated, key=lambda row: row.limit_time)
        lines.append(
            f"{len(saturated)} joint(s) reached their torque limit; longest {most.joint}: "
            f"{most.limit_count} times, {most.limit_time:.3g} s in all"
        )
    stopped = [row for row in limits if row.stop_count]
    if stopped:
        most = max(stopped, key=lambda row: row.stop_count)
        lines.append(
            f"{len(stopped)} joint(s) ran into a stop; most often {most.joint}: "
            f"{most.stop_count} times"
        )
    return lines
