"""Whether a robot walks, from a trace or a summary, in one line of text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.run_record import Event
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.travelled_path import (
    Fall,
    PushEffect,
    TravelledPath,
    find_fall,
    find_push_effect,
    travelled_path,
)
from hexapod_pin.results.walk_causes import (
    NO_ADVICE,
    JointShare,
    Slip,
    advice,
    at_speed_limit,
    at_torque_limit,
    dragging,
    lag,
    lost_legs,
    slip_of,
)
from hexapod_pin.results.walk_cautions import cautions, large_error, vain_limits

LEAST_SHARE = 0.8
"""Fraction of the planned distance, and of the planned yaw, from which a robot walks."""

BACKWARDS = 0.05
"""Fraction of the planned distance, or yaw, from which a robot moves the other way."""


@dataclass(frozen=True, eq=False)
class WalkVerdict(Immutable):
    """What a run comes to as a walk; lengths in metres, angles in radians.

    A robot walks that makes at least 80 % of the planned distance and yaw, does not fall, does not
    touch the ground with its trunk, is not thrown off its track by a push, and drags no foot along
    but those of legs without torque. Where nothing is planned (a posture that is held), or too
    little to be judged (less than a quarter of a stroke), speed, yaw and slip do not count.

    Attributes:
        robot_name: name of the robot.
        travel: distance and yaw, planned and made, over whole cycles of steady walking, else the
            whole run.
        fall: the first fall; None of a robot that stays on its feet.
        trunk_contact: the first contact of the trunk with the ground; None without one.
        trunk_contacts: how many.
        slip: of the feet; None where the run did not gather it.
        at_torque_limit: the joint longest at its torque limit, of the whole run.
        at_speed_limit: the joint longest at its velocity limit, of the whole run.
        lag: the joint farthest from its set-point; `share` is the RMS distance [rad].
        accuracy: requested error in positions [m and rad]; None with fixed steps.
        step: of a fixed-step method [s]; None where steps adapt.
        step_error: largest error of one step, estimated [m and rad]; None with fixed steps.
        error_estimate: how far any position may be off [m and rad]; None where it is not known.
        accuracy_kept: whether the error is within the accuracy requested.
        needs: for how long the run must last to hold one whole cycle [s]; None where it does, or
            nothing repeats.
        prescribed: whether joints follow the plan exactly: limits do not act.
        holds: whether a posture is held: no motion is planned.
        reason: why it does not walk; empty where it does.
        cause: of that, in a few words, where one shows; empty where it walks.
        advice: what to change; empty where it walks.
        change: the field of the gait to change, and its value; None where a run cannot try it.
        doubts: what in the robot's file makes torques doubtful, in short phrases.
        large_error: that the run's own error does; mostly empty.
        push: what pushes did, from the first of them on; None of a run without one.
        lost_legs: legs whose drives gave no torque, from some time of the run on.
        vain_limits: one of the robot's own limits that is beyond any motor's, so that none acts,
            with the unit that was perhaps meant; empty where motors have such.
        cautions: what else to know of a robot that walks, in a few words each.
    """

    robot_name: str
    travel: TravelledPath
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
    cause: str = ""
    change: tuple[str, float] | None = None
    doubts: tuple[str, ...] = ()
    large_error: str = ""
    push: PushEffect | None = None
    lost_legs: tuple[str, ...] = ()
    vain_limits: str = ""
    cautions: tuple[str, ...] = ()

    @property
    def walks(self) -> bool:
        """Whether it does what was planned, on its feet."""
        return not self.reason

    @property
    def untrusted(self) -> tuple[str, ...]:
        """What makes torques doubtful, in short phrases: of the robot's file and of the run."""
        return (*self.doubts, self.large_error) if self.large_error else self.doubts

    @property
    def line(self) -> str:
        """The verdict in one line."""
        return verdict_line(self)

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data."""
        plain: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        plain["travel"] = {f.name: getattr(self.travel, f.name) for f in fields(self.travel)}
        shares = ("measured_speed", "nominal_speed", "speed_share", "turn_share", "yaw_error")
        plain["travel"] |= {name: getattr(self.travel, name) for name in shares}
        plain["push"] = self.push and asdict(self.push)
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

    Raises:
        ParameterError: the run's record has limits of another number of joints.
    """
    _check_limits(trace)
    path, fall, events = travelled_path(trace), find_fall(trace), trace.events
    touches = [event for event in events if event.kind == "trunk-contact"]
    slip = slip_of(trace, path.nominal_speed)
    torque, speed, behind = at_torque_limit(trace), at_speed_limit(trace), lag(trace)
    push = find_push_effect(trace)
    reason = why_it_does_not_walk(path, fall, touches) or ("" if push is None else push.reason)
    lost = lost_legs(trace)
    reason = reason or dragging(slip and slip.per_metre, len(lost))
    hint = NO_ADVICE
    if reason:
        at_start = bool(touches) and touches[0].time <= float(trace.time[0])
        hint = advice(
            trace, at_start=at_start, torque=torque, speed=speed, slip=slip, lag=behind, push=push
        )  # fmt: skip
    numerics = trace.run.numerics
    error = trace.step_error
    return WalkVerdict(
        robot_name=trace.run.robot.name, travel=path, fall=fall,
        trunk_contact=touches[0] if touches else None, trunk_contacts=len(touches), slip=slip,
        at_torque_limit=torque, at_speed_limit=speed, lag=behind,
        accuracy=numerics.accuracy or None,
        step=None if numerics.accuracy else numerics.step,
        step_error=None if math.isnan(error) else error,
        error_estimate=None if trace.error is None else trace.error_estimate,
        accuracy_kept=trace.accuracy_kept, needs=_needs(trace, path),
        prescribed=trace.run.prescribed,
        holds=trace.run.case.controller.get("kind") == "hold",
        reason=reason, advice=hint.text, cause=hint.cause, change=hint.change,
        doubts=trace.run.robot.doubts, large_error=large_error(trace), push=push,
        lost_legs=lost, vain_limits=vain_limits(trace),
        cautions=() if reason else cautions(trace, slip),
    )  # fmt: skip


def _check_limits(trace: Trace) -> None:
    """Refuse a trace whose record is of a robot with other joints."""
    count = len(trace.joint_names)
    if trace.limits and len(trace.limits) != count:
        allowed = f"{count} rows, one for each joint of the trace, or none"
        hint = "The trace was put together of two runs: take both from one, or leave limits out."
        raise ParameterError("Trace.limits", len(trace.limits), allowed, hint)


def why_it_does_not_walk(path: TravelledPath, fall: Fall | None, touches: Sequence[Event]) -> str:
    """Return why a robot does not walk; empty where it does.

    Args:
        path: made and planned.
        fall: the first one.
        touches: contacts of the trunk with the ground, in the order of time.
    """
    if fall is not None:
        return f"it fell: {fall.how} at {fall.time:.3g} s"
    if touches:
        return f"its trunk touched the ground at {touches[0].time:.3g} s ({touches[0].what})"
    for share, what in ((path.speed_share, "speed"), (path.turn_share, "yaw rate")):
        if share is not None and not share >= LEAST_SHARE:
            if share <= -BACKWARDS and what == "speed":
                return f"it slides back at {-path.measured_speed:.2g} m/s"
            if share <= -BACKWARDS:
                rate = math.degrees(abs(path.turn)) / (path.end - path.start)
                return f"it turns the other way at {rate:.2g} deg/s"
            made = f"{share:.0%}".replace("-0%", "0%")
            return f"it makes {made} of the nominal {what}, less than {LEAST_SHARE:.0%}"
    return ""


def _needs(trace: Trace, path: TravelledPath) -> float | None:
    """Return the shortest duration that holds a whole cycle [s], where this run is shorter."""
    cycle = trace.run.walk.cycle_time
    if cycle is None or path.cycles is not None:
        return None
    least = trace.run.walk.steady_from + cycle
    return least if float(trace.time[-1]) < least else None


# The verdict on a walk as one line of text.

SLIPS = 0.05
"""Slip of a foot per metre travelled from which it is named [m/m]."""

EPSILON = 1e-12
"""Planned distance and yaw that are none [m, rad]."""


def verdict_line(verdict: WalkVerdict) -> str:
    """Return the verdict in one line, its parts separated by semicolons."""
    parts = [
        *_distance(verdict),
        "did not fall" if verdict.fall is None
        else f"fell at {verdict.fall.time:.3g} s ({verdict.fall.how})",
        "" if verdict.push is None else verdict.push.line, lost_text(verdict.lost_legs),
        _trunk(verdict), _slip(verdict), _limits(verdict), _accuracy(verdict), _doubt(verdict),
    ]  # fmt: skip
    return f"{verdict.robot_name} {_head(verdict)}: " + "; ".join(filter(None, parts))


def _head(verdict: WalkVerdict) -> str:
    path = verdict.travel
    if path.speed_share is not None or path.turn_share is not None:
        return "walks" if verdict.walks else "does not walk"
    if verdict.holds:
        return "stands" if verdict.walks else "does not stand"
    return "stays on its feet" if verdict.walks else "does not stay on its feet"


def _distance(verdict: WalkVerdict) -> list[str]:
    """Return distance and yaw, and over which time."""
    path = verdict.travel
    time = f"{path.end - path.start:.4g} s"
    count = path.cycles
    steady = "" if count is None else f" ({count} steady cycle{'s' * (count > 1)})"
    found = []
    if path.speed_share is not None and path.speed_share <= -BACKWARDS:
        found.append(
            f"{-path.travelled_distance:.4g} m back in {time}{steady}, where the nominal speed is "
            f"{path.nominal_speed:.4g} m/s ahead"
        )
    elif path.speed_share is not None:
        found.append(
            f"{path.travelled_distance:.4g} m in {time}{steady}, {path.speed_share:.1%} of the "
            f"nominal {path.nominal_speed:.4g} m/s"
        )
    elif path.planned_distance > EPSILON:
        found.append(
            f"{path.travelled_distance:.2g} m of {path.planned_distance:.2g} m in {time}: "
            "too short for a speed"
        )
    yaw, planned = math.degrees(path.turn), math.degrees(path.planned_turn)
    if path.turn_share is not None:
        span = "" if found else f" in {time}{steady}"
        found.append(f"yaw {yaw:.3g} deg{span}, {path.turn_share:.1%} of the nominal {planned:.3g}")
    else:
        found.append(f"yaw off by {math.degrees(path.yaw_error):.2g} deg")
    if verdict.needs is not None:
        found.append(
            f"the whole run is judged: no whole cycle of steady walking, that takes "
            f"{verdict.needs:.4g} s or more"
        )
    return found


def lost_text(legs: Sequence[str]) -> str:
    """Return that legs gave no torque, in a few words; empty of no legs."""
    names = " and ".join(legs)
    return f"leg{'s' * (len(legs) > 1)} {names} without torque" if legs else ""


def _trunk(verdict: WalkVerdict) -> str:
    event, count = verdict.trunk_contact, verdict.trunk_contacts
    if event is None:
        return "trunk clear of the ground"
    return f"trunk on the ground at {event.time:.3g} s ({count} contact{'s' * (count > 1)})"


def _slip(verdict: WalkVerdict) -> str:
    """Return the slip per metre, and the feet that slip most."""
    slip = verdict.slip
    if slip is None:
        return ""
    if slip.per_metre is None or slip.total is None:
        per = "window" if verdict.travel.cycles is None else "cycle"
        return f"slip {1e3 * math.fsum(slip.distance.values()):.3g} mm per {per}, all feet"
    most = max(slip.per_metre, key=slip.per_metre.__getitem__)
    count = sum(value >= SLIPS for value in slip.per_metre.values())
    text = f"slip {slip.total:.2g} m per m"
    return text + (f" ({count} feet slip, most {most} {slip.per_metre[most]:.2g})" if count else "")


def _limits(verdict: WalkVerdict) -> str:
    if verdict.prescribed:
        return "prescribed motion: no limit acts"
    torque = _share("torque", verdict.at_torque_limit)
    speed = _share("velocity", verdict.at_speed_limit)
    if not torque and not speed:
        return "no joint at its torque or velocity limit"
    return ", ".join(filter(None, (torque, speed)))


def _doubt(verdict: WalkVerdict) -> str:
    """Return that torques are not to be trusted, and why; empty where they are."""
    if not verdict.untrusted:
        return ""
    cure = " (--repair)" if verdict.doubts else ""
    return f"torques are NOT to be trusted: {', '.join(verdict.untrusted)}{cure}"


def _share(what: str, share: JointShare) -> str:
    if not share.joints:
        return ""
    return (
        f"{share.joints} joint{'s' * (share.joints > 1)} at the {what} limit, {share.joint} "
        f"{share.share:.2%} of the time"
    )


def _accuracy(verdict: WalkVerdict) -> str:
    if verdict.accuracy is None or verdict.step_error is None:
        return "" if verdict.step is None else f"step {verdict.step:g} s"
    accuracy = f"accuracy {verdict.accuracy:g} requested"
    if verdict.error_estimate is None:
        return f"{accuracy}, {verdict.step_error:.1e} reached in a step"
    met = "met" if verdict.accuracy_kept else "NOT met"
    return f"{accuracy}, {met}: {verdict.error_estimate:.1e}"
