"""The body of HC15, HC17 and HC18: six feet under one mass."""

from __future__ import annotations

from collections.abc import Sequence

from hexapod_pin.formulations.rigid import RigidModel
from hexapod_pin.robot.robot import Robot
from hexapod_pin.validation.cases.bodies import Vector, body

MASS = 3.08746
PLACES = {
    "L1": (0.2475, 0.16), "L2": (0.0, 0.19), "L3": (-0.2475, 0.16),
    "R1": (0.2475, -0.16), "R2": (0.0, -0.19), "R3": (-0.2475, -0.16),
}  # fmt: skip
"""Feet [m], in the order of the robot's."""


def six_feet_robot(
    com: Vector, depth: float, inertia: Vector, feet_of: Sequence[str] = tuple(PLACES)
) -> Robot:
    """Return the body with these feet, `depth` below its origin [m]."""
    feet = {name: (*PLACES[name], -depth) for name in feet_of}
    return body(feet, mass=MASS, com=com, inertia=inertia)


def six_feet(com: Vector, depth: float, inertia: Vector) -> RigidModel:
    """Return the body on rigid ground."""
    return RigidModel(six_feet_robot(com, depth, inertia))


def feet_named(names: str) -> list[int]:
    """Return the indices of feet named like "L1,L3,R2"."""
    return [list(PLACES).index(name) for name in names.split(",")]
