"""Groups of samples that a run records; its events and limits as lines of text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.results.run_record import Event, JointLimits


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


# What of a run is stored as samples: groups of arrays, chosen before it starts.

GROUPS: dict[str, tuple[str, ...]] = {
    "motion": ("time", "q", "v"),
    "torque": ("torque",),
    "set_points": ("q_ref", "v_ref"),
    "contacts": ("foot_position", "foot_force", "foot_gap", "foot_normal", "foot_impulse"),
    "com": ("com",),
    "energy": ("energy",),
    "sliding": ("slip_speed",),
    "current": ("current",),
    "temperature": ("temperature",),
}
"""Arrays of a trace by the group they are recorded with, in the order of lists of groups."""

ON_REQUEST = ("sliding", "current", "temperature")
"""Groups that are recorded only where they are named."""

USUAL = tuple(group for group in GROUPS if group not in ON_REQUEST)
"""Groups that are recorded where none is named."""

ALWAYS = "motion"
"""Recorded whatever is chosen: without it there is no trace."""

GROUP_OF = {array: group for group, arrays in GROUPS.items() for array in arrays}


def recorded_groups(chosen: Iterable[str] | None) -> tuple[str, ...] | None:
    """Return chosen groups in the order of `GROUPS`, `ALWAYS` left out; None: the usual ones.

    Raises:
        ParameterError: an unknown group, or a single text in the place of several.
    """
    if chosen is None:
        return None
    known = ", ".join(GROUPS)
    allowed = f"a list of some of {known}"
    if isinstance(chosen, str | Mapping):
        raise ParameterError("record", chosen, allowed)
    try:
        names = tuple(chosen)
    except TypeError as error:  # nothing to iterate over, such as an array without an axis
        raise ParameterError("record", chosen, allowed) from error
    for name in names:
        if not isinstance(name, str) or name not in GROUPS:
            raise ParameterError("record", name, f"some of {known}")
    stored = tuple(name for name in GROUPS if name in names and name != ALWAYS)
    return None if (ALWAYS, *stored) == USUAL else stored


def left_out(recorded: Sequence[str] | None) -> tuple[str, ...]:
    """Return the arrays that a choice of groups, as `recorded_groups` gives it, leaves out."""
    stored = USUAL if recorded is None else (ALWAYS, *recorded)
    return tuple(array for array, group in GROUP_OF.items() if group not in stored)
