"""The worst instants of a run: what was largest when, of joints, feet, stability and trunk."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.errors import HexapodError
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.stability import stability
from hexapod_pin.results.torque_budget import TorqueBudget, torque_budget
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.travelled_path import find_push_effect
from hexapod_pin.results.walk_causes import Slip
from hexapod_pin.scene.loads import LostLeg, Push
from hexapod_pin.view.torque_limits import Limits

Indices = npt.NDArray[np.intp]
Inside = npt.NDArray[np.bool_]


def worst_instants(
    trace: Trace, limits: Limits, feet: Sequence[Mapping[str, Any]],
    window: Sequence[float] | None, margin: Array | None, slides: Collection[int] = (),
) -> list[dict[str, Any]]:  # fmt: skip
    """Return what was largest when: of each kind of joint, feet, stability and trunk.

    Peaks of torque, speed, power and force are those of the budget, at integration steps, which
    may lie between samples; the others are of samples. All are of the window, else of the run; at
    the end follow those of pushes and lost legs, of samples, while these last (`during`). The
    least margin is from the first sample on at which the robot stands stably, if it does: one that
    is set down has no margin before.

    Each has `key`, `what`, `value`, `unit`, `time` [s], and where they apply `error` (None where it
    is not known), `joint`, `foot`, `use` [-], and `state`: that kept of a torque's peak, by the
    names of channels (`place`, `turn`, `angle`, `speed`, `torque`, `force`), flat lists.

    Args:
        trace: of the run.
        limits: what torques are held against.
        feet: the contact points; empty where contacts were not recorded.
        window: first and last time that count [s]; None: all.
        margin: static stability margin at the samples (T,) [m]; None where it is not known.
        slides: joints that slide: their forces [N] and speeds [m/s] are called so.
    """
    inside = np.ones(len(trace.time), dtype=bool)
    if window is not None:
        inside = (trace.time >= window[0]) & (trace.time <= window[1])
    found = _joint_rows(trace, limits, inside, slides)
    if feet:
        found.append(_force_row(trace, feet, inside))
        if margin is not None:
            stands = inside & (np.cumsum(margin > 0.0) > 0)
            k = _arg(margin, stands if stands.any() else inside, least=True)
            found.append(_row("margin", "stability margin", margin[k], "m", trace.time[k]))
    roll, pitch = _roll_pitch(trace)
    for key, values in (("roll", roll), ("pitch", pitch)):
        k = _arg(np.abs(values), inside)
        found.append(_row(key, f"trunk {key}", values[k], "rad", trace.time[k]))
    for name, during in disturbances(trace):
        found += _disturbance_rows(trace, limits, name, during, margin if feet else None, slides)
    return [row for row in found if math.isfinite(row["time"])]


def steady_numbers(
    trace: Trace, budget: TorqueBudget | None, slip: Slip | None, slides: Collection[int]
) -> list[dict[str, Any]]:
    """Return what holds of the steady cycles and of no instant: speed, slip, RMS torques, work.

    Each has `key`, `what`, `value` and `unit`; empty of a run without a whole cycle.

    Args:
        trace: of the run.
        budget: of the run; None of one without a whole cycle.
        slip: of its verdict.
        slides: joints that slide: RMS forces [N].
    """
    if budget is None:
        return []
    rows: list[tuple[str, float | None, str]] = [
        ("speed", budget.measured_speed, "m/s"),
        ("slip of all feet over the way", None if slip is None else slip.total, "1"),
    ]
    for kind in budget.kinds:
        force = trace.joint_names.index(kind.rms.joint) in slides
        what = f"{kind.kind} RMS {'force' if force else 'torque'}"
        rows.append((what, kind.rms.torque_rms, "N" if force else "N m"))
    rows.append(("cost of transport, absolute work", budget.cost_of_transport, "-"))
    return [
        {"key": what, "what": what, "value": value, "unit": unit}
        for what, value, unit in rows
        if value is not None and math.isfinite(value)
    ]


def disturbances(trace: Trace) -> list[tuple[str, tuple[float, float]]]:
    """Return what disturbed a run, in a word, and from when until when that counts [s].

    Pushes count, as in the verdict, until the robot walks on as before, and until a cycle after the
    last of them; a lost leg counts to the end of the run.
    """
    loads = () if trace.run.scene is None else trace.run.scene.loads
    end, found = float(trace.time[-1]), []
    effect, ends = find_push_effect(trace), [load.end for load in loads if isinstance(load, Push)]
    if effect is not None:
        settled = end if effect.after is None else effect.start + effect.after
        quiet = max(ends) + (trace.run.walk.cycle_time or math.inf)
        found.append(("push", (effect.start, min(end, max(settled, quiet)))))
    lost = {load.leg: load.start for load in loads if isinstance(load, LostLeg)}
    found += [(f"{leg} lost", (start, end)) for leg, start in lost.items() if start < end]
    return found


def _disturbance_rows(
    trace: Trace, limits: Limits, name: str, during: tuple[float, float], margin: Array | None,
    slides: Collection[int],
) -> list[dict[str, Any]]:  # fmt: skip
    """Return the largest torque and use, least margin and lowest trunk while something acts."""
    inside = (trace.time >= during[0]) & (trace.time <= during[1])
    if not inside.any():
        return []
    found, more = [], {"during": list(during)}
    turning = np.array([j for j in range(len(trace.joint_names)) if j not in slides], dtype=np.intp)
    if "torque" in trace.recorded and len(turning):
        sizes = np.abs(trace.torque)
        k, joint = _largest(sizes, turning, inside)
        found.append(_row(f"{name} torque", f"{name}: torque", sizes[k, joint], "N m",
                          trace.time[k], joint=joint, **more))  # fmt: skip
        use = limits.use(trace.torque, trace.v[:, 6:])
        k, joint = _largest(use, turning, inside)
        if use[k, joint] > 0.0:
            found.append(_row(f"{name} use", f"{name}: use of limit", use[k, joint], "1",
                              trace.time[k], joint=joint, **more))  # fmt: skip
    lowest = [("margin", "least margin", margin), ("height", "lowest trunk", trace.q[:, 2])]
    for key, what, values in lowest:
        if values is not None:
            k = _arg(values, inside, least=True)
            found.append(_row(f"{name} {key}", f"{name}: {what}", values[k], "m", trace.time[k],
                              **more))  # fmt: skip
    return found


def _row(
    key: str, what: str, value: float, unit: str, time: float, **more: Any
) -> dict[str, Any]:  # fmt: skip
    number = float(value) if math.isfinite(value) else None
    return {"key": key, "what": what, "value": number, "unit": unit, "time": float(time), **more}


def _arg(values: Array, inside: Inside, least: bool = False) -> int:
    """Return the sample of the largest, or least, value among those inside."""
    shown = np.where(inside, values, np.inf if least else -np.inf)
    return int(np.argmin(shown) if least else np.argmax(shown))


def _joint_rows(
    trace: Trace, limits: Limits, inside: Inside, slides: Collection[int]
) -> list[dict[str, Any]]:
    if "torque" not in trace.recorded or not trace.joint_names:
        return []
    speed, names = trace.v[:, 6:], list(trace.joint_names)
    budget = budget_of(trace)
    gathered = budget is not None and trace.has_summary
    use = limits.use(trace.torque, speed)
    rows, kinds = [], kinds_of(trace)
    for kind in dict.fromkeys(kinds):
        own = np.array([k for k, name in enumerate(kinds) if name == kind])
        if budget is not None:
            worst = next(row for row in budget.kinds if row.kind == kind).peak
            joint, value = names.index(worst.joint), worst.torque_peak
            time, error = worst.torque_peak_time, worst.torque_peak_error
        else:
            k, joint = _largest(np.abs(trace.torque), own, inside)
            value, time, error = abs(trace.torque[k, joint]), trace.time[k], None
        top = float(limits.at_rest[joint])
        more: dict[str, Any] = {}
        if not limits.slope[joint] and not math.isinf(top):
            more["use"] = float(value / top) if top > 0.0 else None
        more |= _kept_state(trace, joint, time)
        what, unit = ("force", "N") if joint in slides else ("torque", "N m")
        rows.append(_row(f"{kind} torque", f"{kind} {what}", value, unit, time, error=error,
                         joint=joint, **more))  # fmt: skip
        if limits.slope[own].any():
            k, joint = _largest(use, own, inside)
            share = float(use[k, joint])
            rows.append(_row(f"{kind} use", f"{kind} use of limit", share, "1", trace.time[k],
                             joint=joint))  # fmt: skip
        k, joint = _largest(np.abs(speed), own, inside)
        value, time = abs(speed[k, joint]), trace.time[k]
        if gathered:
            joint = int(own[np.argmax(np.abs(trace.summary.speed_peak[own]))])
            value = abs(trace.summary.speed_peak[joint])
            time = trace.summary.speed_peak_time[joint]
        unit = "m/s" if joint in slides else "rad/s"
        rows.append(_row(f"{kind} speed", f"{kind} speed", value, unit, time, joint=joint))
    joint, value = 0, 0.0
    if gathered:
        joint = int(np.argmax(np.abs(trace.summary.power_peak)))
        value, time = trace.summary.power_peak[joint], trace.summary.power_peak_time[joint]
    else:
        power = trace.torque * speed
        k, joint = _largest(np.abs(power), np.arange(len(names)), inside)
        value, time = power[k, joint], trace.time[k]
    rows.append(_row("power", "joint power", value, "W", time, joint=joint))
    return rows


def _kept_state(trace: Trace, joint: int, time: float) -> dict[str, Any]:
    """Return the state that the run has kept of a joint's torque peak; nothing where of another."""
    kept = trace.peaks
    if kept is None or kept.foot_names != trace.foot_names or kept.time[joint] != time:
        return {}
    parts = {
        "place": kept.q[joint, :3], "turn": kept.q[joint, 3:7], "angle": kept.q[joint, 7:],
        "speed": kept.v[joint, 6:], "torque": kept.torque[joint], "force": kept.foot_force[joint],
    }  # fmt: skip
    return {"state": {name: _short(values) for name, values in parts.items()}}


def _short(values: Array) -> list[float]:
    """Return numbers with ten digits."""
    return [float(f"{value:.10g}") for value in values.ravel()]


def _largest(values: Array, own: Indices, inside: Inside) -> tuple[int, int]:
    """Return sample and joint of the largest value among some joints."""
    shown = np.where(inside[:, None], values[:, own], -np.inf)
    k, column = np.unravel_index(int(np.argmax(shown)), shown.shape)
    return int(k), int(own[column])


def _force_row(
    trace: Trace, feet: Sequence[Mapping[str, Any]], inside: Inside
) -> dict[str, Any]:  # fmt: skip
    if budget_of(trace) is not None and trace.has_summary and len(trace.summary.force_peak):
        foot = int(np.argmax(trace.summary.force_peak))
        value, time = trace.summary.force_peak[foot], trace.summary.force_peak_time[foot]
        error = float(trace.summary.error_of("force_peak")[foot])
    else:
        k, foot = _largest(trace.normal_force, np.arange(len(feet)), inside)
        value, time, error = trace.normal_force[k, foot], trace.time[k], math.nan
    known = None if math.isnan(error) else error
    return _row("force", "foot force, normal", value, "N", time, foot=foot, error=known)


def _roll_pitch(trace: Trace) -> tuple[Array, Array]:
    """Return roll and pitch of the trunk (T,), of Rz(yaw) Ry(pitch) Rx(roll) [rad]."""
    x, y, z, w = (trace.q[:, 3:7] / np.linalg.norm(trace.q[:, 3:7], axis=1, keepdims=True)).T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return roll, np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))


def kinds_of(trace: Trace) -> tuple[str, ...]:
    """Return the kind of every joint."""
    return joint_kinds(trace.joint_names, len(trace.foot_names), trace.run.robot.joint_kinds)


def budget_of(trace: Trace) -> TorqueBudget | None:
    """Return the torque budget; None of a run without a whole cycle."""
    try:
        return torque_budget(trace)
    except HexapodError:
        return None


def margins_of(trace: Trace) -> Array | None:
    """Return the static margin at every sample (T,) [m]; None where it is not known."""
    try:
        return stability(trace, whole=True).static_margin
    except HexapodError:
        return None
