"""A run leaves facts beside its samples: events, joints at their limits, the planned yaw rate.

Its case is kept as text, and the groups of samples are chosen before it starts.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import parsed_toml, read_toml


@dataclass(frozen=True)
class Event:
    """Something that happened.

    Attributes:
        time: [s].
        kind: "trunk-contact": a point of the trunk came to touch the ground.
        what: name of the part.
        place: where, world axes [m].
    """

    time: float
    kind: str
    what: str
    place: tuple[float, float, float]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {**asdict(self), "place": list(self.place)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Event:
        """Return what `to_dict` was of."""
        x, y, z = data["place"]
        return cls(float(data["time"]), str(data["kind"]), str(data["what"]), (x, y, z))


# How often and how long the joints of a run were at their limits.


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


# The yaw rate that a run's gait plans.


def gait_turn_rate(meta: Mapping[str, Any]) -> float:
    """Return the planned yaw rate of the gait that a run's controller names [rad/s], or 0."""
    if "gait_turn_rate" in meta:
        return float(meta["gait_turn_rate"])
    text = str(meta.get("controller", ""))
    try:
        gait = parsed_toml(text).get("gait", {}) if text else {}
    except ParameterError:
        return 0.0
    return float(gait.get("turn_rate", 0.0)) if isinstance(gait, Mapping) else 0.0


# The case that a trace or summary keeps, as one text.

ORDER = ("schema", "run", "controller", "scene", "initial")


def case_toml(meta: Mapping[str, Any]) -> str:
    """Return the case of a run's `meta` as TOML text, as `Case.to_toml` wrote it.

    Raises:
        ParameterError: what was run was no case, or a release that kept none ran it.
    """
    import tomli_w

    if "run" not in meta:
        hint = "A session is led from outside; older files hold no case."
        raise ParameterError("meta", sorted(meta), "that of a case's run", hint)
    parts = read_toml(meta["run"])
    for name in ("controller", "scene"):
        parts[name] = read_toml(meta[name])
    return tomli_w.dumps({name: parts[name] for name in ORDER if name in parts})


# What of a run is kept as samples: groups of arrays, chosen before it starts.

GROUPS: dict[str, tuple[str, ...]] = {
    "motion": ("time", "q", "v"),
    "torque": ("torque",),
    "set_points": ("q_ref", "v_ref"),
    "contacts": ("foot_position", "foot_force", "foot_gap", "foot_normal", "foot_impulse"),
    "com": ("com",),
    "energy": ("energy",),
}
"""Arrays of a trace by the group they are recorded with, in the order in which groups are told."""

ALWAYS = "motion"
"""Recorded whatever is chosen: without it there is no trace."""

GROUP_OF = {array: group for group, arrays in GROUPS.items() for array in arrays}


def recorded_groups(chosen: Iterable[str] | None) -> tuple[str, ...] | None:
    """Return chosen groups in the order of `GROUPS`, `ALWAYS` left out; None where all are.

    Raises:
        ParameterError: an unknown group, or a single text in the place of several.
    """
    if chosen is None:
        return None
    known = ", ".join(GROUPS)
    allowed = f"a list of some of {known}"
    if isinstance(chosen, str):
        raise ParameterError("record", chosen, allowed)
    try:
        names = tuple(chosen)
    except TypeError as error:  # nothing to iterate over, such as an array without an axis
        raise ParameterError("record", chosen, allowed) from error
    for name in names:
        if not isinstance(name, str) or name not in GROUPS:
            raise ParameterError("record", name, f"some of {known}")
    kept = tuple(name for name in GROUPS if name in names and name != ALWAYS)
    return None if len(kept) == len(GROUPS) - 1 else kept


def left_out(recorded: Sequence[str] | None) -> tuple[str, ...]:
    """Return the arrays that a choice of groups, as `recorded_groups` gives it, leaves out."""
    if recorded is None:
        return ()
    kept = (ALWAYS, *recorded)
    return tuple(array for array, group in GROUP_OF.items() if group not in kept)
