"""The torque budget: what every joint must deliver over whole gait cycles of steady walking.

Powers and energies are mechanical, at the joint: torque times rate. What motors and gears lose
comes on top.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_budget import joint_rows, kind_rows
from hexapod_pin.results.robot_budget import TorqueBudget
from hexapod_pin.results.steady_window import Window, steady_window
from hexapod_pin.results.trace import Trace
from hexapod_pin.spec import read_toml


def torque_budget(trace: Trace) -> TorqueBudget:
    """Return what every joint must deliver, over whole cycles after the start-up transient.

    Energies and distance are per cycle. Where nothing repeats (a posture held), the window is the
    second half of the run, energies are those of the window, and there is no cost of transport.

    Raises:
        ParameterError: the trace holds no whole cycle of steady walking; says how long to
            simulate.
    """
    window = steady_window(trace)
    joints = joint_rows(trace, window)
    distance = _distance_per_cycle(trace, window)
    gravity = np.asarray(trace.meta.get("gravity", (0.0, 0.0, -9.81)), dtype=float)
    duration = (window.end - window.start) / window.parts
    nominal = trace.meta.get("nominal_speed")
    return TorqueBudget(
        robot=str(trace.meta.get("robot_name", "robot")),
        window=window,
        joints=joints,
        kinds=kind_rows(joints),
        positive_energy=sum(row.positive_energy for row in joints),
        negative_energy=sum(row.negative_energy for row in joints),
        distance=distance,
        speed=None if distance is None else distance / duration,
        nominal_speed=None if nominal is None or window.cycles is None else float(nominal),
        weight=float(trace.meta.get("total_mass", 0.0)) * float(np.linalg.norm(gravity)),
        largest_outside=_largest_outside(trace, window, max(row.peak_torque for row in joints)),
        sources=_sources(trace.meta),
        assumed=tuple(trace.meta.get("assumed", ())),
    )


def _distance_per_cycle(trace: Trace, window: Window) -> float | None:
    """Return the centre of mass' mean way per cycle along the heading [m].

    The heading is the direction of travel at the start, turned with the trunk's yaw; the way of
    each cycle is projected on the heading at its middle, so that turning gaits count too.
    """
    if window.cycles is None:
        return None
    edges = np.linspace(window.start, window.end, 2 * window.cycles + 1)
    index = np.array([int(np.argmin(np.abs(trace.time - t))) for t in edges])
    ways = np.diff(trace.com[index[::2], :2], axis=0)
    turn = _yaw(trace.q[index[1::2]]) - _yaw(trace.q[:1])
    along = np.asarray(trace.meta.get("travel_direction", (1.0, 0.0)), dtype=float)
    cos, sin = np.cos(turn), np.sin(turn)
    heading = np.stack([cos * along[0] - sin * along[1], sin * along[0] + cos * along[1]], axis=1)
    return float(np.mean(np.sum(ways * heading, axis=1)))


def _yaw(q: Array) -> Array:
    """Return the trunk's yaw [rad] of (k, nq) positions."""
    x, y, z, w = q[:, 3:7].T
    yaw: Array = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaw


def _largest_outside(trace: Trace, window: Window, peak: float) -> tuple[str, float, float] | None:
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
    walk = [gait.get("name"), *(f"{k} {gait[k]:g}" for k in ("stroke", "cycle_time") if k in gait)]
    step = meta.get("step")
    rows = {
        "robot": meta.get("provenance"),
        "control": ", ".join(filter(None, [control.get("kind"), *walk])),
        "contact": " with ".join(filter(None, laws)),
        "method": meta.get("method")
        and f"{meta['method']}" + (f", step {step:g} s" if step else ""),
    }
    return tuple(f"{key}: {text}" for key, text in rows.items() if text)


def _toml(text: str) -> dict[str, Any]:
    """Return TOML text as data; nothing where it is none."""
    try:
        return read_toml(text)
    except ParameterError:
        return {}
