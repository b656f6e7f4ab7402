"""Sizes of what is drawn, from the trace: reach of the robot, ground level, scale of forces."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.results.trace import Trace


@dataclass(frozen=True)
class Sizes:
    """Lengths that fit the picture to the robot."""

    reach: float  # trunk to farthest foot at the start, horizontally [m]
    ground: float  # height of the ground's top [m]
    force_scale: float  # arrow length per force [m/N]

    @classmethod
    def of(cls, trace: Trace, force_scale: float | None) -> Sizes:
        """Measure a trace; by default an arrow of the robot's weight is 1.5 reaches long."""
        radii = np.asarray(trace.meta.get("foot_radius") or np.zeros(len(trace.foot_names)))
        ground, reach = 0.0, 0.3
        if trace.foot_names and "contacts" in trace.recorded:
            away = trace.foot_position[0, :, :2] - trace.q[0, :2]
            reach = max(0.05, float(np.max(np.linalg.norm(away, axis=1))))
            ground = float(np.mean(trace.foot_position[0, :, 2] - radii - trace.foot_gap[0]))
        if force_scale is None:
            force_scale = 1.5 * reach / _weight(trace)
        elif not (math.isfinite(force_scale) and force_scale > 0.0):
            raise ParameterError("force_scale", force_scale, "positive and finite [m/N]")
        return cls(reach, ground, force_scale)


def _weight(trace: Trace) -> float:
    """Return the robot's weight, or where it has none the largest foot force, or 1 [N]."""
    gravity = float(np.linalg.norm(trace.meta.get("gravity", (0.0, 0.0, -9.81))))
    weight = float(trace.meta.get("total_mass", 0.0)) * gravity
    if weight or "contacts" not in trace.recorded:
        return weight or 1.0
    return float(np.max(np.linalg.norm(trace.foot_force, axis=-1), initial=0.0)) or 1.0
