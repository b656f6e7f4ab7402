"""A summary holds numbers with axes, unit and meaning.

Their errors come from a companion run of another resolution.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array

SCHEMA = "hexapod_pin.summary"
SCHEMA_VERSION = 1

JOINT, FOOT, SCALAR = ("joint",), ("foot",), ()

LAYOUT: dict[str, tuple[tuple[str, ...], str, str]] = {
    "window_time": (SCALAR, "s", "length of the window"),
    "torque_peak": (JOINT, "N m", "torque of largest size"),
    "torque_peak_time": (JOINT, "s", "its time"),
    "torque_p99": (JOINT, "N m", "torque not exceeded for 99 % of the time"),
    "torque_rms": (JOINT, "N m", "RMS torque"),
    "at_limit": (JOINT, "1", "share of the time at the torque limit"),
    "limit_use": (JOINT, "1", "largest torque over the torque limit at its speed"),
    "speed_peak": (JOINT, "rad/s", "rate of largest size"),
    "speed_peak_time": (JOINT, "s", "its time"),
    "speed_rms": (JOINT, "rad/s", "RMS rate"),
    "acceleration_rms": (JOINT, "rad/s^2", "RMS acceleration"),
    "torque_acceleration": (JOINT, "N m rad/s^2", "mean of torque times acceleration"),
    "power_peak": (JOINT, "W", "power of largest size"),
    "power_peak_time": (JOINT, "s", "its time"),
    "positive_energy": (JOINT, "J", "work given per cycle"),
    "negative_energy": (JOINT, "J", "work taken up per cycle"),
    "angle_min": (JOINT, "rad", "smallest angle"),
    "angle_max": (JOINT, "rad", "largest angle"),
    "outside_torque": (JOINT, "N m", "torque of largest size outside the window"),
    "outside_torque_time": (JOINT, "s", "its time"),
    "force_peak": (FOOT, "N", "largest normal force"),
    "force_peak_time": (FOOT, "s", "its time"),
    "normal_impulse": (FOOT, "N s", "impulse of the normal force per cycle"),
    "impulse": (("foot", "axis"), "N s", "impulse per cycle, world axes"),
    "slip_distance": (FOOT, "m", "way of the contact point on the ground per cycle"),
    "loaded_time": (FOOT, "s", "time on the ground per cycle"),
    "friction_work": (FOOT, "J", "work of friction by its size per cycle"),
    "outside_force": (FOOT, "N", "largest normal force outside the window"),
    "outside_force_time": (FOOT, "s", "its time"),
    "height_min": (SCALAR, "m", "least height of the trunk"),
    "height_max": (SCALAR, "m", "largest height of the trunk"),
    "height_mean": (SCALAR, "m", "mean height of the trunk"),
    "height_rms": (SCALAR, "m", "RMS height of the trunk about its mean"),
    "heave_rms": (SCALAR, "m", "RMS height of the trunk about its straight line in time"),
    "roll_mean": (SCALAR, "rad", "mean roll"),
    "roll_rms": (SCALAR, "rad", "RMS roll"),
    "roll_peak": (SCALAR, "rad", "roll of largest size"),
    "pitch_mean": (SCALAR, "rad", "mean pitch"),
    "pitch_rms": (SCALAR, "rad", "RMS pitch"),
    "pitch_peak": (SCALAR, "rad", "pitch of largest size"),
    "roll_rate_rms": (SCALAR, "rad/s", "RMS angular velocity about the trunk's x axis"),
    "pitch_rate_rms": (SCALAR, "rad/s", "RMS angular velocity about the trunk's y axis"),
    "vertical_acceleration_rms": (SCALAR, "m/s^2", "RMS vertical acceleration of the trunk"),
    "path": (("edge", "path_column"), "s, m, m, rad", "time, centre of mass, yaw at half cycles"),
    "first_yaw": (SCALAR, "rad", "yaw at the start"),
}
"""Name: (axes, unit, meaning) of every number."""

PER_CYCLE = (
    "positive_energy", "negative_energy", "normal_impulse", "impulse", "slip_distance",
    "loaded_time", "friction_work",
)  # fmt: skip
"""What the core sums over all cycles."""


def shape_of(axes: tuple[str, ...], sizes: Mapping[str, int], array: Array) -> tuple[int, ...]:
    """Return the shape that an array of these axes must have."""
    return (
        (len(array), 4) if axes == ("edge", "path_column") else tuple(sizes[axis] for axis in axes)
    )


def from_native(native: Mapping[str, Any]) -> dict[str, Any]:
    """Return the data of a summary from what the core gathered: energies and ways per cycle."""
    cycles = int(native["cycles"]) if native["cycle_time"] > 0.0 else None
    data: dict[str, Any] = {name: native.get(name) for name in LAYOUT}
    for name in PER_CYCLE:
        if data[name] is not None:
            data[name] = data[name] / (cycles or 1)
    return {"cycles": cycles, "states": int(native["states"]), **data}


# Errors of a summary's numbers, from the numbers of a companion of another resolution.

WITHOUT_ERROR = ("path", "first_yaw")
"""Numbers that others are made of."""

DURATIONS = ("loaded_time", "window_time")
"""Times that are no instants: of these the error is known."""


def number_errors(
    numbers: Mapping[str, Any], companion: Mapping[str, Any], error_fraction: float
) -> dict[str, Any]:
    """Return how far each number of a summary may be off, in its unit.

    Of numbers with a sign, that of their size. Times of peaks have none: of two peaks of the same
    height either may be found.

    Args:
        numbers: those of `Summary.data`.
        companion: those of a companion.
        error_fraction: of the difference that the error is at most [-].
    """
    found: dict[str, Any] = {}
    for name in LAYOUT:
        value, other = numbers.get(name), companion.get(name)
        instant = name.endswith("_time") and name not in DURATIONS
        if instant or name in WITHOUT_ERROR:
            continue
        if value is None or other is None or np.shape(value) != np.shape(other):
            continue
        change = np.abs(np.abs(np.asarray(value)) - np.abs(np.asarray(other)))
        found[name] = (error_fraction * change).tolist()
    return found
