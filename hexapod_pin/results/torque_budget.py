"""The torque budget: what every joint must deliver over whole gait cycles of steady walking.

Powers and energies are mechanical, at the joint: torque times rate. What motors and gears lose
comes on top.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_budget import JointBudget, joint_rows, kind_rows, summary_rows
from hexapod_pin.results.planned_turn import gait_turn_rate
from hexapod_pin.results.robot_budget import ACCEPTED_STEPS, SAMPLES, TorqueBudget
from hexapod_pin.results.steady_window import Window, steady_window, summary_window
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.way import distance_per_cycle, trunk_yaw
from hexapod_pin.spec import parsed_toml


@checked
def torque_budget(run: Trace | Summary) -> TorqueBudget:
    """Return what every joint must deliver, over whole cycles after the start-up transient.

    Energies and distance are per cycle. Where nothing repeats (a posture held), the window is the
    second half of the run, energies are those of the window, and there is no cost of transport.
    Peaks are those of accepted steps, where the run gathered a summary; of samples otherwise.

    Args:
        run: a trace, or the summary of a run.

    Raises:
        ParameterError: the run holds no whole cycle of steady walking; says how long to
            simulate.
    """
    if isinstance(run, Summary):
        return _of_summary(run, summary_window(run))
    if run.has_summary:
        summary = run.summary
        return _of_summary(summary, summary_window(summary, run.time))
    return _of_samples(run, steady_window(run))


def _of_summary(summary: Summary, window: Window) -> TorqueBudget:
    joints = summary_rows(summary)
    worst, size = int(np.argmax(np.abs(summary.outside_torque))), np.abs(summary.outside_torque)
    outside = None
    if size[worst] > max(row.peak_torque for row in joints):
        time = float(summary.outside_torque_time[worst])
        outside = (summary.joint_names[worst], time, float(size[worst]))
    return _budget(
        summary.meta, window, joints, summary.distance, summary.turn_rate, outside, ACCEPTED_STEPS
    )


def _of_samples(trace: Trace, window: Window) -> TorqueBudget:
    joints = joint_rows(trace, window)
    outside = _largest_outside(trace, max(row.peak_torque for row in joints))
    distance = _sampled_distance(trace, window)
    yaw = np.unwrap(trunk_yaw(trace.q[window.samples]))
    rate = None if window.cycles is None else float(yaw[-1] - yaw[0]) / (window.end - window.start)
    return _budget(trace.meta, window, joints, distance, rate, outside, SAMPLES)


def _budget(
    meta: Mapping[str, Any],
    window: Window,
    joints: tuple[JointBudget, ...],
    distance: float | None,
    turn_rate: float | None,
    outside: tuple[str, float, float] | None,
    peaks: str,
) -> TorqueBudget:
    """Put a budget together."""
    gravity = np.asarray(meta.get("gravity", (0.0, 0.0, -9.81)), dtype=float)
    duration = (window.end - window.start) / window.parts
    nominal = meta.get("nominal_speed")
    budget = TorqueBudget(
        robot=str(meta.get("robot_name", "robot")),
        window=window,
        joints=joints,
        kinds=kind_rows(joints),
        positive_energy=sum(row.positive_energy for row in joints),
        negative_energy=sum(row.negative_energy for row in joints),
        distance=distance,
        speed=None if distance is None else distance / duration,
        nominal_speed=None if nominal is None or window.cycles is None else float(nominal),
        weight=float(meta.get("total_mass", 0.0)) * float(np.linalg.norm(gravity)),
        largest_outside=outside,
        sources=_sources(meta),
        assumed=tuple(meta.get("assumed", ())),
        peaks=peaks,
        turn=None if turn_rate is None else turn_rate * duration,
        nominal_turn=gait_turn_rate(meta) * duration,
    )
    _require_numbers(budget)
    return budget


def _require_numbers(budget: TorqueBudget) -> None:
    """Refuse a budget with numbers that are none, as of forged samples.

    Raises:
        ParameterError: names the joint, or the number of the whole robot.
    """
    whole = ("positive_energy", "negative_energy", "weight", "distance", "speed", "turn")
    found = {name: getattr(budget, name) for name in whole}
    for row in budget.joints:
        for name in ("peak_torque", "rms_torque", "positive_energy", "negative_energy"):
            found[f"{row.joint}.{name}"] = getattr(row, name)
    for name, value in found.items():
        if value is not None and not math.isfinite(value):
            hint = "The samples, or the summary, that it is made of are no run's."
            raise ParameterError(f"TorqueBudget.{name}", value, "finite", hint)


def _sampled_distance(trace: Trace, window: Window) -> float | None:
    """Return the centre of mass' mean way per cycle along the heading [m]; None without cycles."""
    if window.cycles is None:
        return None
    edges = np.linspace(window.start, window.end, 2 * window.cycles + 1)
    index = np.array([int(np.argmin(np.abs(trace.time - t))) for t in edges])
    along = np.asarray(trace.meta.get("travel_direction", (1.0, 0.0)), dtype=float)
    turn = trunk_yaw(trace.q[index]) - trunk_yaw(trace.q[:1])
    return distance_per_cycle(trace.com[index, :2], turn, along)


def _largest_outside(trace: Trace, peak: float) -> tuple[str, float, float] | None:
    """Return the largest torque outside the window if it exceeds the peak within."""
    size = np.abs(trace.torque)
    sample, joint = np.unravel_index(int(np.argmax(size)), size.shape)
    if size[sample, joint] <= peak:
        return None
    return trace.joint_names[joint], float(trace.time[sample]), float(size[sample, joint])


def _sources(meta: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what was simulated, one line each: robot, walk, contact, numerics."""
    scene, control = _toml(meta.get("scene", "")), _toml(meta.get("controller", ""))
    contact, gait = scene.get("contact", {}), control.get("gait", {})
    laws = [contact.get(part, {}).get("kind") for part in ("normal", "friction")]
    walk = _walk_words(gait) if isinstance(gait, Mapping) else []
    step = meta.get("step")
    rows = {
        "robot": meta.get("provenance"),
        "control": ", ".join(map(str, filter(None, [control.get("kind"), *walk]))),
        "contact": " with ".join(filter(None, laws)),
        "method": meta.get("method")
        and f"{meta['method']}" + (f", step {step:g} s" if step else ""),
    }
    return tuple(f"{key}: {text}" for key, text in rows.items() if text)


def _walk_words(gait: Mapping[str, Any]) -> list[Any]:
    sizes = {name: gait.get(name) for name in ("stroke", "cycle_time")}
    told = [f"{name} {x:g}" for name, x in sizes.items() if isinstance(x, int | float)]
    return [gait.get("name"), *told]


def _toml(text: str) -> Mapping[str, Any]:
    """Return TOML text as data; nothing where it is none."""
    try:
        return parsed_toml(text)
    except ParameterError:
        return {}
