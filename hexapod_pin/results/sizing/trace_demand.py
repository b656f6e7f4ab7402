"""The demand of a trace: samples in its window, and what accepted steps tell beyond them."""

from __future__ import annotations

from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.robot_budget import ACCEPTED_STEPS, SAMPLES, TorqueBudget
from hexapod_pin.results.sizing.holding_demand import holding_demand
from hexapod_pin.results.sizing.joint_demand import JointDemand
from hexapod_pin.results.sizing.sampled_numbers import sampled_numbers
from hexapod_pin.results.steady_window import Window, steady_window, summary_window
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.trace import Trace

MOST_POSTURES = 32
"""Postures of a window in which holding torque and inertia are looked at."""


@checked
def joint_demand(trace: Trace, *, postures: int = MOST_POSTURES) -> JointDemand:
    """Return what the joints of a walk demand of any motor; see `JointDemand`.

    Peaks, RMS and energies are those of accepted steps where the run gathered a summary, of samples
    otherwise; what needs the course over time is of samples.

    Args:
        trace: of a walk.
        postures: of the window, evenly spread, in which holding torque and inertia are looked at.

    Raises:
        NotRecordedError: the trace holds no torques.
        ParameterError: the run holds no whole cycle of steady walking, or fewer than 2 postures.
    """
    if postures < 2:
        raise ParameterError("postures", postures, "at least 2")
    whole = torque_budget(trace)
    summary = trace.summary if trace.has_summary else None
    window = steady_window(trace) if summary is None else summary_window(summary, trace.time)
    inside = window.samples
    time, torque, speed = trace.time[inside], trace.torque[inside], trace.v[inside, 6:]
    numbers: dict[str, Any] = sampled_numbers(time, torque, speed, window.parts)
    notes = [_source(summary)]
    if summary is not None:
        numbers |= _accepted(summary, trace, numbers)
    numbers |= _of_robot(trace, window, postures, notes)
    notes += _limited(whole)
    makes_way = whole.makes_way and whole.distance is not None
    return JointDemand(
        joint_names=trace.joint_names,
        kinds=joint_kinds(trace.joint_names, len(trace.foot_names), trace.meta),
        time=time, torque=torque, speed=speed,
        acceleration=np.gradient(trace.v[:, 6:], trace.time, axis=0)[inside],
        cycles=window.cycles, peaks=SAMPLES if summary is None else ACCEPTED_STEPS,
        weight=whole.weight, distance=whole.distance if makes_way else None, robot=whole.robot,
        notes=tuple(notes), **numbers,
    )  # fmt: skip


def _accepted(summary: Summary, trace: Trace, sampled: dict[str, Any]) -> dict[str, Any]:
    """Return the numbers of accepted steps; samples' where an older file does not hold them."""
    found = {
        "p99_torque": summary.torque_p99,
        "rms_torque": summary.torque_rms,
        "rms_speed": summary.speed_rms,
        "acceleration_rms": summary.acceleration_rms,
        "torque_acceleration": summary.torque_acceleration,
        "peak_power": np.fmax(np.abs(summary.power_peak), sampled["peak_power"]),
        "peak_speed": np.fmax(np.abs(summary.speed_peak), sampled["peak_speed"]),
        "positive_energy": summary.positive_energy,
        "negative_energy": summary.negative_energy,
    }
    found = {k: np.where(np.isfinite(v), v, sampled[k]) for k, v in found.items()}
    larger = np.abs(summary.torque_peak) > sampled["peak_torque"]
    times, peaks = summary.torque_peak_time, summary.torque_peak
    rates = [np.interp(t, trace.time, trace.v[:, 6 + j]) for j, t in enumerate(times)]
    accepted = {
        "peak_torque": np.abs(peaks),
        "peak_torque_time": times,
        "peak_torque_speed": np.array(rates) * np.sign(peaks),
    }
    return found | {k: np.where(larger, v, sampled[k]) for k, v in accepted.items()}


def _of_robot(trace: Trace, window: Window, postures: int, notes: list[str]) -> dict[str, Any]:
    """Return what needs the robot's model; NaN with a note where the trace does not tell it."""
    unknown = np.full(len(trace.joint_names), np.nan)
    nothing = {"armature": np.zeros(len(unknown))} | dict.fromkeys(
        ("load_inertia", "standing", "holding", "holding_lost_leg"), unknown
    )
    try:
        robot = RecordedRobot.of(trace)
    except ParameterError as error:
        notes.append(
            f"holding torque and load inertia are unknown, armature is taken as 0: {error}"
        )
        return nothing
    first, stop = window.samples.start, window.samples.stop
    picked = np.unique(np.linspace(first, stop - 1, postures).round().astype(int))
    known = {"armature": robot.armature, "load_inertia": load_inertia(robot, trace.q[picked])}
    if "contacts" not in trace.recorded or not robot.gravity.any():
        notes.append("holding torque is unknown: the trace holds no contacts, or no weight")
        return nothing | known
    held = holding_demand(robot, trace, picked)
    notes.extend(held.notes)
    return known | held.numbers


def load_inertia(robot: RecordedRobot, q: Array) -> Array:
    """Return the mean diagonal of the mass matrix, joints only, without rotors (n,) [kg m^2].

    The moment of inertia about its axis of everything a joint carries outwards.

    Args:
        robot: with its payloads.
        q: postures. Shape (K, nq).
    """
    import pinocchio as pin

    model, data = robot.model, robot.model.createData()
    found = np.zeros(model.nv)
    for posture in q:
        found += np.diag(pin.crba(model, data, posture)) - model.armature
    return np.asarray(found[6:] / len(q))


def _limited(budget: TorqueBudget) -> list[str]:
    """Say where the run's own limits cut off what the joints would have been asked for."""
    cut = {row.joint: row.at_limit for row in budget.joints if row.at_limit > 0.0}
    if not cut:
        return []
    most = max(cut, key=lambda joint: cut[joint])
    return [
        f"{len(cut)} joints were at the torque limit of the run, {most} for "
        f"{100.0 * cut[most]:.2g} % of the time: what a stronger motor would be asked for there is "
        "not known from it"
    ]


def _source(summary: Summary | None) -> str:
    """Say which numbers are of what."""
    if summary is None:
        return "all numbers are of samples: what lies between two is missed"
    return (
        "peaks, p99, RMS, accelerations and mechanical energies are of accepted steps; share "
        "outside the line, moving RMS and battery are of samples; peak use is the larger of the "
        "samples' and that of the accepted steps' peak at the speed sampled at its time"
    )
