"""S2 appendix eqs. 1-4 against the core, Pinocchio, finite differences and RNEA."""

from __future__ import annotations

import numpy as np

from hexapod_pin.formulations.inverse import torque_under_forces
from hexapod_pin.formulations.rigid import derivative, prescribed_derivative
from hexapod_pin.robot.state import State
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.validation.checks.samples import (
    SEED,
    constrained_motion,
    rigid_robot,
    some_feet,
    states,
    worst,
)
from hexapod_pin.validation.hard_case import Check

STATES = 100
FEW_STATES = 20


def core_terms() -> float:
    """Return how far M, h and foot rows are from the core's."""
    from hexapod_pin import native

    model, error = rigid_robot("kharagpur"), 0.0
    plant = native_plant(Scene(model.robot))
    for q, v in states(model, FEW_STATES):
        found, terms = native.evaluate(plant, q, v, np.zeros(len(v) - 6)), model.terms(q, v)
        down = found["foot_gap"] < 0.0
        rows = found["foot_jacobian"].reshape(terms.rows.shape)
        bias = terms.bias - np.concatenate([np.zeros(6), model.robot.damping * v[6:]])
        error = max(
            error, worst(found["mass"], terms.mass), worst(found["bias"], bias),
            worst(rows[down], terms.rows[down]),
        )  # fmt: skip
    return error


def core_motion() -> float:
    """Return what the core's acceleration and foot forces leave in the RNEA with those forces."""
    from hexapod_pin import native

    model, error, rng = rigid_robot("kharagpur"), 0.0, np.random.default_rng(SEED)
    plant = native_plant(Scene(model.robot))
    for q, v in states(model, FEW_STATES):
        torque = rng.normal(size=len(v) - 6)
        found = native.evaluate(plant, q, v, torque)
        needed = torque_under_forces(model, q, v, found["acceleration"], found["foot_force"])
        wanted = np.concatenate([np.zeros(6), torque])
        scale = max(float(np.abs(found["foot_force"]).max()), 1.0)
        error = max(error, float(np.abs(needed - wanted).max()) / scale)
    return error


def drift_rows() -> float:
    """Return how far J' v is from central differences of J v, spheres rolling."""
    import pinocchio as pin

    model, error, h = rigid_robot("kharagpur"), 0.0, 1e-5
    for q, v in states(model, FEW_STATES):
        ahead, back = (model.positions(pin.integrate(model.model, q, s * v))[1] for s in (h, -h))
        error = max(error, worst((ahead - back) @ v / (2.0 * h), model.terms(q, v).drift))
    return error


def pinocchio_motion() -> float:
    """Return how far acceleration and forces are from `pin.constraintDynamics`."""
    model, error = rigid_robot("kharagpur", 0.0), 0.0
    rng = np.random.default_rng(SEED)
    for q, v in states(model, STATES):
        feet, torque = some_feet(rng), rng.normal(size=len(v) - 6)
        found = derivative(model, State(q, v), torque, feet)
        acceleration, force = constrained_motion(model, q, v, torque, feet)
        error = max(error, worst(found.acceleration, acceleration), worst(found.force[feet], force))
    return error


def gait_form() -> float:
    """Return how far the gait form is from the free form whose joint accelerations it is given.

    From three feet on the joints determine the base; the split differs, its balance must not.
    """
    model, error = rigid_robot("kharagpur", 0.0), 0.0
    rng = np.random.default_rng(SEED)
    for q, v in states(model, FEW_STATES):
        feet = sorted(rng.choice(6, int(rng.integers(3, 7)), replace=False).tolist())
        free = derivative(model, State(q, v), rng.normal(size=len(v) - 6), feet)
        planned = prescribed_derivative(model, State(q, v), free.acceleration[6:], feet)
        needed = torque_under_forces(model, q, v, planned.acceleration, planned.force)
        wanted = np.concatenate([np.zeros(6), planned.torque])
        error = max(
            error, worst(planned.acceleration, free.acceleration),
            float(np.abs(needed - wanted).max() / np.abs(planned.force).max()),
        )  # fmt: skip
    return error


CHECKS = (
    Check("core-terms", "M, h, J of six feet: core against Pinocchio", core_terms, 1e-12,
          source="S2 app. eq. 1"),
    Check("core-motion", "acceleration and foot forces of the core, put into RNEA", core_motion,
          1e-10, source="S2 app. eq. 2"),
    Check("drift", "J' v of rolling feet against differences of J v", drift_rows, 1e-8,
          source="S2 app. eq. 3"),
    Check("pinocchio-motion", "grounded feet: eqs. 1-4 against pin.constraintDynamics, 100 cases",
          pinocchio_motion, 1e-9, source="S2 app. eq. 4"),
    Check("gait-form", "gait form against the free form and RNEA", gait_form, 1e-9,
          source="S2 app. eq. 4"),
)  # fmt: skip
