"""The numbers of each joint that samples alone tell: peaks, means, energies."""

from __future__ import annotations

from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.sizing.time_mean import rms, time_weights


def sampled_numbers(time: Array, torque: Array, speed: Array, parts: int) -> dict[str, Any]:
    """Return the numbers per joint that samples alone tell; energies are over `parts`."""
    size, power = np.abs(torque), torque * speed
    top, joints = size.argmax(axis=0), np.arange(size.shape[1])
    step, change = np.diff(time)[:, None], np.diff(speed, axis=0)
    length, weights = float(time[-1] - time[0]), time_weights(time)
    middle = 0.5 * (torque[1:] + torque[:-1])
    return {
        "peak_torque": size[top, joints],
        "peak_torque_time": time[top],
        "peak_torque_speed": speed[top, joints] * np.sign(torque[top, joints]),
        "peak_speed": np.abs(speed).max(axis=0),
        "p99_torque": np.percentile(size, 99.0, axis=0),
        "rms_torque": rms(time, torque),
        "rms_speed": rms(time, speed),
        "acceleration_rms": np.sqrt(np.sum(change**2 / step, axis=0) / length),
        "torque_acceleration": np.sum(middle * change, axis=0) / length,
        "peak_power": np.abs(power).max(axis=0),
        "positive_energy": length / parts * (weights @ np.maximum(power, 0.0)),
        "negative_energy": length / parts * (weights @ np.minimum(power, 0.0)),
    }
