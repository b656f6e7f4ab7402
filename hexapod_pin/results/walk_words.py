"""The verdict on a walk as one line of text."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hexapod_pin.results.walk_loads import JointShare

if TYPE_CHECKING:
    from hexapod_pin.results.walk_verdict import WalkVerdict

SLIPS = 0.05
"""Slip of a foot per metre travelled from which it is named [m/m]."""

EPSILON_WAY = 1e-12
"""Planned way and yaw that are none [m, rad]."""


def verdict_line(verdict: WalkVerdict) -> str:
    """Return the verdict in one line, its parts separated by semicolons."""
    parts = [
        *_way(verdict),
        "did not fall" if verdict.fall is None
        else f"fell at {verdict.fall.time:.3g} s ({verdict.fall.how})",
        _trunk(verdict), _slip(verdict), _limits(verdict), _accuracy(verdict),
    ]  # fmt: skip
    return f"{verdict.robot} {_head(verdict)}: " + "; ".join(filter(None, parts))


def _head(verdict: WalkVerdict) -> str:
    way = verdict.way
    if way.speed_share is not None or way.turn_share is not None:
        return "walks" if verdict.walks else "does not walk"
    if verdict.holds:
        return "stands" if verdict.walks else "does not stand"
    return "stays on its feet" if verdict.walks else "does not stay on its feet"


def _way(verdict: WalkVerdict) -> list[str]:
    """Return way and yaw, and over which time."""
    way = verdict.way
    time = f"{way.end - way.start:.4g} s"
    steady = "" if way.cycles is None else f" ({way.cycles} steady cycle{'s' * (way.cycles > 1)})"
    found = []
    if way.speed_share is not None:
        found.append(
            f"{way.way:.4g} m in {time}{steady}, {way.speed_share:.1%} of the nominal "
            f"{way.nominal_speed:.4g} m/s"
        )
    elif way.planned_way > EPSILON_WAY:
        found.append(f"{way.way:.2g} m of {way.planned_way:.2g} m in {time}: too short for a speed")
    yaw, planned = math.degrees(way.turn), math.degrees(way.planned_turn)
    if way.turn_share is not None:
        span = "" if found else f" in {time}{steady}"
        found.append(f"yaw {yaw:.3g} deg{span}, {way.turn_share:.1%} of the nominal {planned:.3g}")
    else:
        found.append(f"yaw off by {math.degrees(way.yaw_error):.2g} deg")
    if verdict.needs is not None:
        found.append(
            f"the whole run is judged: no whole cycle of steady walking, that takes "
            f"{verdict.needs:.4g} s or more"
        )
    return found


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
        per = "window" if verdict.way.cycles is None else "cycle"
        return f"slip {1e3 * math.fsum(slip.path.values()):.3g} mm per {per}, all feet"
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
    asked = f"accuracy {verdict.accuracy:g} asked"
    if verdict.error_estimate is None:
        return f"{asked}, {verdict.step_error:.1e} reached in a step"
    return f"{asked}, {'' if verdict.accuracy_kept else 'NOT '}kept: {verdict.error_estimate:.1e}"
