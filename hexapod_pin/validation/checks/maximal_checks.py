"""S1's maximal coordinates against the core: accelerations with contacts, and a motion."""

from __future__ import annotations

from hexapod_pin.robot.robot import load_robot
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.validation.checks.maximal_twin import (
    compare_accelerations,
    pressed_states,
)
from hexapod_pin.validation.hard_case import Check

FEW_STATES = 40


def accelerations() -> float:
    """Return the largest relative difference of accelerations at random states with contacts."""
    scene = Scene(load_robot("kharagpur"))
    return compare_accelerations(scene, pressed_states(scene, FEW_STATES))


CHECKS = (
    Check("maximal-motion", "accelerations on feet: core against maximal coordinates, 40 states",
          accelerations, 1e-9, source="S1 eqs. 1-3"),
)  # fmt: skip
