"""Compliant contact of the core against rigid contact as it stiffens."""

from __future__ import annotations

from hexapod_pin.validation.checks.limits import damped_impact, slow_gait, tripod
from hexapod_pin.validation.hard_case import Check


def tripod_force() -> float:
    """Return the difference of foot forces over the weight at 1e8 N/m."""
    return tripod(1e8).force


def tripod_order() -> float:
    """Return how far the differences at 1e6 and 1e8 N/m are from falling like 1/K."""
    return abs(tripod(1e6).force / tripod(1e8).force / 100.0 - 1.0)


def gait_torque() -> float:
    """Return the difference of torques [N m] in mid-stance of a slow tripod gait at 1e8 N/m."""
    return slow_gait(1e8).torque


def impact() -> float:
    """Return the difference of v+ on dampers of 1e7 N s/m, over the largest speed before."""
    return damped_impact(1e7)


CHECKS = (
    Check("tripod-limit", "feet of a tripod: core at 1e8 N/m against rigid, per weight",
          tripod_force, 1e-4, source="S2 app. eq. 4"),
    Check("tripod-order", "the same falls like 1/K from 1e6 to 1e8 N/m", tripod_order, 0.05,
          source="S2 app. eq. 4"),
    Check("gait-limit", "torques of a slow gait: core at 1e8 N/m against the rigid walk",
          gait_torque, 2e-4, "N m", "S2 app. eqs. 4, 5"),
    Check("impact-limit", "core on dampers of 1e7 N s/m against eq. 5", impact, 1e-4,
          source="S2 app. eq. 5"),
)  # fmt: skip
