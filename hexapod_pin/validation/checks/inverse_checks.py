"""Statics and inverse dynamics against HC15, HC16, HC17 and between two solvers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.inverse import (
    Compliant,
    ContactSprings,
    LeastTorque,
    inverse_dynamics,
    stance_load,
    tipping_slope,
)
from hexapod_pin.validation.cases.bodies import SIX_FEET
from hexapod_pin.validation.cases.robots import answers
from hexapod_pin.validation.checks.impact_checks import hc18_model
from hexapod_pin.validation.checks.samples import feet_named, rigid_robot, six_feet, worst
from hexapod_pin.validation.hard_case import Check

LEVEL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
REST = np.zeros(6)


def hc15_tripods() -> float:
    """Return the largest relative error of the loads of two tripods."""
    model, known = six_feet((0.013, -0.007, 0.0), 0.0, (0.05, 0.07, 0.1)), answers("HC15")
    error = 0.0
    for name in ("tripod L1,L3,R2", "tripod L2,R1,R3"):
        feet = feet_named(name.split()[1])
        force = inverse_dynamics(model, LEVEL, REST, REST, feet).force[feet, 2]
        error = max(error, _relative(force, known[name]))
    return error


def hc15_springs() -> float:
    """Return the largest relative error of the loads of five and six feet on springs K d^n."""
    model, error = six_feet((0.013, -0.007, 0.0), 0.0, (0.05, 0.07, 0.1)), 0.0
    for name, case in answers("HC15")["six_compliant"].items():
        five = "R2 lifted" in name
        feet = [k for k, foot in enumerate(SIX_FEET) if not (five and foot == "R2")]
        numbers = [1.5, 1e6] if five else [float(part.split("=")[1]) for part in name.split(",")]
        load = stance_load(model, LEVEL, REST, REST, feet)
        force = ContactSprings(stiffness=numbers[1], exponent=numbers[0]).share(load)
        wanted = case.get("N_L1..L3,R1..R3", case.get("N"))
        error = max(error, _relative(force[2::3], wanted))
    return error


def hc16() -> float:
    """Return the largest error of the torques under HC16's loads, over the largest torque."""
    model, known, error = rigid_robot("hexa_ref"), answers("HC16"), 0.0
    q = model.robot.stand(np.tile([0.0, -0.3, 0.3], 6)).q
    order = [name.removesuffix("_foot") for name in model.foot_names]
    still = np.zeros(len(q) - 1)
    for name, standing in (
        ("tripod_L1_L3_R2", ("L1", "L3", "R2")), ("six_min_norm", known["foot_order"]),
    ):  # fmt: skip
        feet = [order.index(foot) for foot in standing]
        found = inverse_dynamics(model, q, still, still, feet)
        torque = dict(zip(known["joint_order"], known[name]["tau"], strict=True))
        wanted = np.array([torque[joint] for joint in model.robot.joint_names])
        load = np.array(known[name]["N"])
        error = max(error, worst(found.torque, wanted), worst(found.force[feet, 2], load))
    return error


def hc17() -> float:
    """Return the largest error of two tipping slopes [degrees]."""
    model, known = hc18_model(), answers("HC17")
    error = 0.0
    for axis, heading in (("x", 0.0), ("y", 0.5 * math.pi)):
        found = math.degrees(tipping_slope(model, LEVEL, heading))
        error = max(error, abs(found - known[f"tip_angle_slope_along_{axis}_deg"]))
    return error


def least_torque() -> float:
    """Return how far the least-torque split is from the elastic one that must equal it.

    With equal servos, rigid contact and no cone or limit in the way both minimise sum tau^2: one
    by a quadratic program, the other as the rest of an elastic robot.
    """
    model = rigid_robot("kharagpur")
    q, still = model.robot.stand().q, np.zeros(model.model.nv)
    feet = range(6)
    least = inverse_dynamics(model, q, still, still, feet, LeastTorque())
    elastic = inverse_dynamics(model, q, still, still, feet, Compliant(servo=240.0))
    return worst(least.torque, elastic.torque)


def _relative(found: Array, wanted: Any) -> float:
    exact = np.array([float(x) for x in wanted])
    return float(np.abs(found / exact - 1.0).max())


CHECKS = (
    Check("hc15-tripods", "loads of two tripods under an off-centre mass", hc15_tripods, 1e-9,
          source="HC15"),
    Check("hc15-springs", "loads of five and six feet on springs K d^n", hc15_springs, 1e-9,
          source="HC15"),
    Check("hc16", "static torques of hexa_ref on three and six feet", hc16, 1e-10, source="HC16"),
    Check("hc17", "slope at which six feet tip, along and across", hc17, 1e-9, "degrees", "HC17"),
    Check("least-torque", "least-torque split against the elastic one, cones open", least_torque,
          1e-9, source="Castigliano"),
)  # fmt: skip
