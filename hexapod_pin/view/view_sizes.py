"""Sizes of what is drawn, from the trace: reach of the robot, ground level, scale of forces."""

from __future__ import annotations

import numbers
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.trace import Trace

ASIDE = 0.3
"""Distance of the trunk's origin from the feet's mean, over the farthest foot's, that is too far
for a picture around it."""


FORCE_SCALES = (1e-9, 1e3, "m/N")
"""Lengths of arrows per force that a picture is made for; a walk's are near 0.01 m/N."""


def require_in(name: str, value: Any, allowed: tuple[float, float, str]) -> None:
    """Refuse a number outside a range, given as its ends and its unit.

    Raises:
        ParameterError: names the number and the range.
    """
    least, most, unit = allowed
    number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not (number and least <= value <= most):
        raise ParameterError(name, value, f"from {least:g} to {most:g} {unit}")


@dataclass(frozen=True)
class Sizes:
    """Lengths that fit the picture to the robot."""

    reach: float  # middle to farthest foot at the start, horizontally [m]
    ground: float  # height of the ground's top [m]
    force_scale: float  # arrow length per force [m/N]

    @classmethod
    def of(cls, trace: Trace, force_scale: float | None) -> Sizes:
        """Measure a trace; by default an arrow of the robot's weight is 1.5 reaches long."""
        radii = np.asarray(trace.meta.get("foot_radius") or np.zeros(len(trace.foot_names)))
        ground, reach = 0.0, 0.3
        if trace.foot_names and "contacts" in trace.recorded:
            away = trace.foot_position[0, :, :2] - middle(trace, np.zeros(1, dtype=np.intp))[0]
            reach = max(0.05, float(np.max(np.linalg.norm(away, axis=1))))
            ground = float(np.mean(trace.foot_position[0, :, 2] - radii - trace.foot_gap[0]))
        if force_scale is None:
            force_scale = 1.5 * reach / _weight(trace)
        else:
            require_in("force_scale", force_scale, FORCE_SCALES)
        return cls(reach, ground, force_scale)


def middle(trace: Trace, index: npt.NDArray[np.intp]) -> Array:
    """Return x and y of the robot's middle at some samples (K, 2) [m].

    It is the trunk's origin; where that lies well aside of the feet, as in drawings exported with
    a frame far from the body, the point of the trunk that was between the feet at the start.
    """
    places = trace.q[index, :2]
    if not trace.foot_names or "contacts" not in trace.recorded:
        return np.asarray(places)
    feet = trace.foot_position[0, :, :2]
    aside = feet.mean(axis=0) - trace.q[0, :2]
    span = float(np.max(np.linalg.norm(feet - feet.mean(axis=0), axis=1)))
    if not np.linalg.norm(aside) > ASIDE * span:
        return np.asarray(places)
    turned = _yaw(trace.q[index]) - _yaw(trace.q[:1])
    cos, sin = np.cos(turned), np.sin(turned)
    x, y = aside
    return np.asarray(places + np.column_stack([cos * x - sin * y, sin * x + cos * y]))


def eye_level(trace: Trace) -> float:
    """Return the height that a picture looks at [m]: the trunk's origin at the start.

    Where that is below the feet, or as high as 1.5 times their distance from the middle, 0.4
    times this distance above the feet.
    """
    height = float(trace.q[0, 2])
    if not trace.foot_names or "contacts" not in trace.recorded:
        return height
    feet, reach = float(np.mean(trace.foot_position[0, :, 2])), Sizes.of(trace, 1.0).reach
    return height if 0.0 <= height - feet <= 1.5 * reach else feet + 0.4 * reach


def _yaw(q: Array) -> Array:
    """Return the trunk's heading (K,) [rad]."""
    x, y, z, w = q[:, 3:7].T
    return np.asarray(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def _weight(trace: Trace) -> float:
    """Return the robot's weight, or where it has none the largest foot force, or 1 [N]."""
    gravity = float(np.linalg.norm(trace.meta.get("gravity", (0.0, 0.0, -9.81))))
    weight = float(trace.meta.get("total_mass", 0.0)) * gravity
    if weight or "contacts" not in trace.recorded:
        return weight or 1.0
    return float(np.max(np.linalg.norm(trace.foot_force, axis=-1), initial=0.0)) or 1.0
