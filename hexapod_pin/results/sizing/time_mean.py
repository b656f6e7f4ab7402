"""Means over time of samples: the trapezoidal rule, and a first-order lag gone round and round."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array


def time_weights(time: Array) -> Array:
    """Return what share of the time each sample stands for, by the trapezoidal rule (T,) [-]."""
    step = np.diff(time)
    weights = np.zeros(len(time))
    weights[:-1] += 0.5 * step
    weights[1:] += 0.5 * step
    return np.asarray(weights / (time[-1] - time[0]))


def rms(time: Array, values: Array) -> Array:
    """Return the square root of the time average of the squares (T, ...) -> (...)."""
    return np.asarray(np.sqrt(time_weights(time) @ np.square(values)))


def largest_lagged(time: Array, values: Array, constant: float) -> Array:
    """Return the largest value of a first-order lag, y' = (x - y) / constant, of each column.

    The samples are taken to repeat for ever: the lag starts where it ends. Between samples x is
    linear in time and the lag is exact.

    Args:
        time: [s]. Shape (T,).
        values: x. Shape (T, n).
        constant: [s], positive.

    Returns:
        Shape (n,); between the mean of x (constant far above the time) and its largest value.
    """
    step = np.diff(time)
    decay = np.exp(-step / constant)
    ramp = 1.0 + np.expm1(-step / constant) * constant / step  # share of a rise that has arrived
    rise = np.diff(values, axis=0)
    gain = (1.0 - decay)[:, None] * values[:-1] + ramp[:, None] * rise
    course = np.empty(values.shape)
    course[0] = 0.0
    for k in range(len(step)):
        course[k + 1] = decay[k] * course[k] + gain[k]
    start = course[-1] / -np.expm1((time[0] - time[-1]) / constant)
    left = np.exp((time[0] - time) / constant)[:, None]
    return np.asarray(np.max(course + left * start, axis=0))
