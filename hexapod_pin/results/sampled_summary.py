"""The summary of a trace: the one that its run gathered, or one computed from its samples.

Runs of the core gather a summary. Traces of `formulations.rigid.simulate`, or made of other data,
have none; what lies between two of their samples is missed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.joint_budget import LIMITED_TORQUE_SHARE
from hexapod_pin.results.schema import from_plain, schema
from hexapod_pin.results.steady_window import steady_window
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.rotations import trunk_yaw


def summary_of(trace: Trace) -> Summary:
    """Return the summary of a trace, of its samples where its run gathered none.

    A summary of samples has the numbers of a torque budget; the others are NaN.

    Raises:
        NotRecordedError: it is to be computed, and the trace holds no torques or centres of mass.
        ParameterError: it is to be computed, and the run holds no whole cycle of steady walking.
    """
    if trace.gathered is not None:
        return trace.gathered
    window = steady_window(trace)
    inside = window.samples
    time, torque, speed = trace.time[inside], trace.torque[inside], trace.v[inside, 6:]
    found: dict[str, Any] = sampled_numbers(time, torque, speed, window.parts)
    del found["torque_peak_speed"]
    signed = {"torque": torque, "speed": speed, "power": torque * speed}
    for name, values in signed.items():
        found[f"{name}_peak"], found[f"{name}_peak_time"] = _largest(time, values)
    power = torque * speed
    found["driving_power_peak"] = np.maximum(power, 0.0).max(axis=0)
    found["braking_power_peak"] = np.maximum(-power, 0.0).max(axis=0)
    found["outside_torque"], found["outside_torque_time"] = _largest(trace.time, trace.torque)
    limit = trace.run.robot.effort(len(trace.joint_names))
    found["at_limit"] = np.mean(np.abs(torque) >= LIMITED_TORQUE_SHARE * limit, axis=0)
    found["window_time"] = window.end - window.start
    found["first_yaw"] = float(trunk_yaw(trace.q[:1])[0])
    found["path"] = _path(trace, np.linspace(window.start, window.end, 2 * window.parts + 1))
    sizes = {"joint": len(trace.joint_names), "foot": len(trace.foot_names), "path_column": 4}
    numbers = from_plain(Summary, dict.fromkeys(schema(Summary)) | found, {**sizes, "axis": 3})
    return Summary(
        trace.joint_names, trace.foot_names, window.cycles, len(trace.time), **numbers,
        counters=trace.counters, run=trace.run.of_summary,
    )  # fmt: skip


def _largest(time: Array, values: Array) -> tuple[Array, Array]:
    """Return the value of largest size in each column, and its time."""
    top = np.abs(values).argmax(axis=0)
    return values[top, np.arange(values.shape[1])], time[top]


def _path(trace: Trace, times: Array) -> Array:
    """Return time, centre of mass and yaw at the samples nearest to some times (E, 4)."""
    rows = [int(np.argmin(np.abs(trace.time - one))) for one in times]
    return np.column_stack([trace.time[rows], trace.com[rows, :2], trunk_yaw(trace.q[rows])])


def sampled_numbers(time: Array, torque: Array, speed: Array, parts: int) -> dict[str, Any]:
    """Return peaks, means and energies of joints by their samples.

    Args:
        time: [s]. Shape (T,).
        torque: [N m]. Shape (T, n).
        speed: signed [rad/s]. Shape (T, n).
        parts: what energies are divided by: the number of cycles.
    """
    size, power = np.abs(torque), torque * speed
    top, joints = size.argmax(axis=0), np.arange(size.shape[1])
    step, change = np.diff(time)[:, None], np.diff(speed, axis=0)
    length, weights = float(time[-1] - time[0]), time_weights(time)
    middle = 0.5 * (torque[1:] + torque[:-1])
    return {
        "torque_peak": size[top, joints],
        "torque_peak_time": time[top],
        "torque_peak_speed": speed[top, joints] * np.sign(torque[top, joints]),
        "speed_peak": np.abs(speed).max(axis=0),
        "torque_p99": np.percentile(size, 99.0, axis=0),
        "torque_rms": rms(time, torque),
        "speed_rms": rms(time, speed),
        "acceleration_rms": np.sqrt(np.sum(change**2 / step, axis=0) / length),
        "torque_acceleration": np.sum(middle * change, axis=0) / length,
        "power_peak": np.abs(power).max(axis=0),
        "positive_energy": length / parts * (weights @ np.maximum(power, 0.0)),
        "negative_energy": length / parts * (weights @ np.minimum(power, 0.0)),
    }


def time_weights(time: Array) -> Array:
    """Return the fraction of the time that each sample stands for, by trapezoids (T,) [-]."""
    step = np.diff(time)
    weights = np.zeros(len(time))
    weights[:-1] += 0.5 * step
    weights[1:] += 0.5 * step
    return np.asarray(weights / (time[-1] - time[0]))


def rms(time: Array, values: Array) -> Array:
    """Return the square root of the time average of the squares (T, ...) -> (...)."""
    return np.asarray(np.sqrt(time_weights(time) @ np.square(values)))
