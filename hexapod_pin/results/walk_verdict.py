"""Does it walk? A run in one line: way, yaw, falls, slip, limits, accuracy; and what to change."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from hexapod_pin.arguments import checked, explain_methods
from hexapod_pin.results.event import Event
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_advice import advice
from hexapod_pin.results.walk_fall import Fall, find_fall
from hexapod_pin.results.walk_loads import (
    JointShare,
    Slip,
    at_speed_limit,
    at_torque_limit,
    lag,
    slip_of,
)
from hexapod_pin.results.walk_words import verdict_line
from hexapod_pin.results.walked_way import WalkedWay, settings_of, walked_way

LEAST_SHARE = 0.8
"""Share of the planned way, and of the planned yaw, from which a robot walks."""


@explain_methods
@dataclass(frozen=True, eq=False)
class WalkVerdict:
    """What a run comes to as a walk; lengths in metres, angles in radians.

    A robot walks that makes at least 80 % of the planned way and of the planned yaw, does not fall
    and does not touch the ground with its trunk. Where nothing is planned (a posture that is held),
    or too little to be judged (less than a quarter of a stroke), only the latter count.

    Attributes:
        robot: name of the robot.
        way: way and yaw, planned and made, over whole cycles of steady walking, else the whole run.
        fall: the first fall; None of a robot that stays on its feet.
        trunk_contact: the first contact of the trunk with the ground; None without one.
        trunk_contacts: how many.
        slip: of the feet; None where the run did not gather it.
        at_torque_limit: the joint longest at its torque limit, of the whole run.
        at_speed_limit: the joint longest at its velocity limit, of the whole run.
        lag: the joint farthest from its set-point; `share` is the RMS distance [rad].
        accuracy: error in positions that was asked for [m and rad]; None with fixed steps.
        step: of a fixed-step method [s]; None where steps adapt.
        step_error: largest error of one step, estimated [m and rad]; None with fixed steps.
        error_estimate: how far any position may be off [m and rad]; None where it is not known.
        accuracy_kept: whether what was asked is kept.
        needs: for how long the run must last to hold one whole cycle [s]; None where it does, or
            nothing repeats.
        prescribed: whether joints follow the plan exactly: limits do not act.
        holds: whether a posture is held: no way is asked for.
        reason: why it does not walk; empty where it does.
        advice: what to change; empty where it walks.
    """

    robot: str
    way: WalkedWay
    fall: Fall | None
    trunk_contact: Event | None
    trunk_contacts: int
    slip: Slip | None
    at_torque_limit: JointShare
    at_speed_limit: JointShare
    lag: JointShare
    accuracy: float | None
    step: float | None
    step_error: float | None
    error_estimate: float | None
    accuracy_kept: bool
    needs: float | None
    prescribed: bool
    holds: bool
    reason: str
    advice: str

    @property
    def walks(self) -> bool:
        """Whether it does what was planned, on its feet."""
        return not self.reason

    @property
    def line(self) -> str:
        """The verdict in one line."""
        return verdict_line(self)

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data."""
        plain: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        plain["way"] = {f.name: getattr(self.way, f.name) for f in fields(self.way)}
        shares = ("speed", "nominal_speed", "speed_share", "turn_share", "yaw_error")
        plain["way"] |= {name: getattr(self.way, name) for name in shares}
        plain["fall"] = self.fall and {"time": self.fall.time, "how": self.fall.how}
        plain["trunk_contact"] = self.trunk_contact and self.trunk_contact.to_dict()
        for name in ("slip", "at_torque_limit", "at_speed_limit", "lag"):
            value = getattr(self, name)
            plain[name] = None if value is None else value._asdict()
        return {"walks": self.walks, "line": self.line, **plain}


@checked
def walk_verdict(trace: Trace) -> WalkVerdict:
    """Return whether a run walks as planned; where not, why, and what to change.

    Speed and yaw are those over the whole cycles of steady walking, as in the torque budget. A
    walk without a whole cycle, one that ends in it, or one that follows a velocity command is
    judged over the whole run, against the planned motion of its body.

    Args:
        trace: of any run: straight or turning walks, stops, commands, prescribed motion, feedback.

    Example:
        >>> verdict = walk_verdict(trace)
        >>> print(verdict.line)
        >>> assert verdict.walks, verdict.advice
    """
    way, fall, events = walked_way(trace), find_fall(trace), trace.events
    touches = [event for event in events if event.kind == "trunk-contact"]
    slip = slip_of(trace, way.nominal_speed)
    torque, speed, behind = at_torque_limit(trace), at_speed_limit(trace), lag(trace)
    reason = why_it_does_not_walk(way, fall, touches)
    hint = ""
    if reason:
        at_start = bool(touches) and touches[0].time <= float(trace.time[0])
        hint = advice(
            trace, at_start=at_start, torque=torque, speed=speed, slip=slip, lag=behind
        )  # fmt: skip
    scene = settings_of(trace.meta, "scene")
    accuracy = trace.meta.get("accuracy")
    error = trace.step_error
    return WalkVerdict(
        robot=str(trace.meta.get("robot_name", "robot")), way=way, fall=fall,
        trunk_contact=touches[0] if touches else None, trunk_contacts=len(touches), slip=slip,
        at_torque_limit=torque, at_speed_limit=speed, lag=behind, accuracy=accuracy or None,
        step=None if accuracy else trace.meta.get("step"),
        step_error=None if math.isnan(error) else error,
        error_estimate=None if trace.error is None else trace.error_estimate,
        accuracy_kept=trace.accuracy_kept, needs=_needs(trace, way),
        prescribed=bool(scene.get("prescribed", False)),
        holds=settings_of(trace.meta, "controller").get("kind") == "hold",
        reason=reason, advice=hint,
    )  # fmt: skip


def why_it_does_not_walk(way: WalkedWay, fall: Fall | None, touches: Sequence[Event]) -> str:
    """Return why a robot does not walk; empty where it does.

    Args:
        way: made and planned.
        fall: the first one.
        touches: contacts of the trunk with the ground, in the order of time.
    """
    if fall is not None:
        return f"it fell: {fall.how} at {fall.time:.3g} s"
    if touches:
        return f"its trunk touched the ground at {touches[0].time:.3g} s ({touches[0].what})"
    for share, what in ((way.speed_share, "speed"), (way.turn_share, "yaw rate")):
        if share is not None and not share >= LEAST_SHARE:
            return f"it makes {share:.0%} of the nominal {what}, less than {LEAST_SHARE:.0%}"
    return ""


def _needs(trace: Trace, way: WalkedWay) -> float | None:
    """Return the shortest duration that holds a whole cycle [s], where this run is shorter."""
    cycle = trace.meta.get("cycle_time")
    if cycle is None or way.cycles is not None:
        return None
    least = float(trace.meta.get("steady_from") or 0.0) + float(cycle)
    return least if float(trace.time[-1]) < least else None
