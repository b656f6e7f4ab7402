"""The body of HC15, HC17 and HC18 on rigid ground."""

from __future__ import annotations

from hexapod_pin.formulations.rigid import RigidModel
from hexapod_pin.validation.cases.bodies import SIX_FEET, Vector, six_feet_body


def six_feet(com: Vector, depth: float, inertia: Vector) -> RigidModel:
    """Return the body with its feet `depth` below its origin [m]."""
    return RigidModel(six_feet_body(com, depth, inertia))


def feet_named(names: str) -> list[int]:
    """Return the indices of feet named like "L1,L3,R2"."""
    return [list(SIX_FEET).index(name) for name in names.split(",")]
