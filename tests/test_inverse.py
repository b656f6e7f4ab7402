"""Inverse dynamics and its splits: HC15-HC17, balance, cones, limits, optimality."""

from __future__ import annotations

import math

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.inverse import (
    Compliant,
    ContactSprings,
    InfeasibleError,
    LeastTorque,
    MinimumNorm,
    NoRestError,
    inverse_dynamics,
    normal_force_margin,
    prescribed_gait,
    pyramid,
    stance_load,
    torque_under_forces,
)
from hexapod_pin.formulations.rigid import RigidGround, RigidModel
from hexapod_pin.validation.checks import inverse_checks
from hexapod_pin.validation.checks.samples import rigid_robot, six_feet, states

SPLITS = (MinimumNorm(), Compliant(normal=1e5, tangential=3e4, servo=240.0), LeastTorque())


@pytest.mark.parametrize("check", inverse_checks.CHECKS, ids=lambda check: check.name)
def test_statics_against_independent_answers(check) -> None:
    assert check.run() <= check.tolerance


@pytest.mark.parametrize("split", SPLITS, ids=lambda split: split.label)
def test_every_split_balances_a_moving_robot(split) -> None:
    model = RigidModel(hp.load_robot("kharagpur"), ground=RigidGround(mu=50.0))
    rng = np.random.default_rng(1)
    for q, v in states(model, 3):
        acceleration = 0.5 * rng.normal(size=24)
        free = LeastTorque(limited=False) if isinstance(split, LeastTorque) else split
        found = inverse_dynamics(model, q, v, acceleration, [0, 2, 3, 4], free)
        left = torque_under_forces(model, q, v, acceleration, found.force)
        assert np.abs(left[:6]).max() < 1e-10
        assert left[6:] == pytest.approx(found.torque, abs=1e-10)
        assert found.split == split.label
        assert not found.unique[[0, 2, 3, 4]].all()


def test_cones_and_limits_bind() -> None:
    robot = hp.load_robot("kharagpur")
    q, still = robot.stand().q, np.zeros(24)
    sums = []
    for mu in (0.7, 0.1, 0.02):
        model = RigidModel(robot, ground=RigidGround(mu=mu))
        found = inverse_dynamics(model, q, still, still, range(6), LeastTorque(sides=16))
        flat = np.linalg.norm(found.force[:, :2], axis=1)
        assert (flat <= mu * found.force[:, 2] * (1.0 + 1e-9)).all()
        assert np.abs(found.imbalance).max() < 1e-10
        sums.append(float(found.torque @ found.torque))
    assert sums[0] < sums[1] < sums[2]
    model = RigidModel(robot)
    free = inverse_dynamics(model, q, still, still, [0, 2, 4], LeastTorque())
    peak = float(np.abs(free.torque).max())
    load = stance_load(model, q, still, still, [0, 2, 4])
    assert 0.0 < normal_force_margin(load) < load.wrench[2]
    # a linear program puts the least possible peak at 0.97014 of this one
    tight = type(load)(**{**vars(load), "effort": np.full(18, 0.98 * peak)})
    kept = load.torque(LeastTorque().share(tight))
    assert np.abs(kept).max() == pytest.approx(0.98 * peak, rel=1e-9)
    assert kept @ kept > free.torque @ free.torque
    nothing = type(load)(**{**vars(load), "effort": np.full(18, 0.97 * peak)})
    with pytest.raises(InfeasibleError):
        LeastTorque().share(nothing)


def test_springs_without_a_rest_are_refused() -> None:
    robot = six_feet((0.0, 0.0, 0.0), 0.0, (0.05, 0.07, 0.1)).robot
    model = RigidModel(robot, gravity=(0.0, 0.0, 9.81))
    level, still = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), np.zeros(6)
    with pytest.raises(NoRestError):
        ContactSprings(1e6).share(stance_load(model, level, still, still, range(6)))


@pytest.mark.parametrize(
    ("split", "name", "value"),
    [
        (Compliant, "Compliant.servo", math.inf),
        (lambda: Compliant(servo=-1.0), "Compliant.servo", -1.0),
        (lambda: ContactSprings(-1.0), "ContactSprings.stiffness", -1.0),
        (lambda: ContactSprings(1.0, 0.5), "ContactSprings.exponent", 0.5),
        (lambda: pyramid(np.array([0.0, 0.0, 1.0]), 0.5, 2), "sides", 2),
    ],
)
def test_split_parameters_are_checked(split, name: str, value: float) -> None:
    with refused(ParameterError, name, value):
        split()


def test_planned_tetrapod_stands_beside_the_static_envelope() -> None:
    """S2's tetrapod on its plan: feet agree on the base, forces carry the weight."""
    model = rigid_robot("kharagpur", 0.0)
    time = np.linspace(4.8, 7.2, 60, endpoint=False) + 1e-4
    planned = prescribed_gait(model, hp.Gait.tetrapod(), time)
    assert planned.residual.max() < 1e-5
    weight = model.robot.total_mass * 9.81
    assert planned.force[:, :, 2].sum(axis=1).mean() == pytest.approx(weight, rel=1e-3)
    femur = np.abs(planned.torque[:, 1::3]).max()
    assert 1.31 < femur < 1.31 * 1.15
    least = prescribed_gait(model, hp.Gait.tetrapod(), time[::4], LeastTorque())
    assert (least.torque**2).sum() < (planned.torque[::4] ** 2).sum()
    assert least.pulling_share == 0.0 and least.sliding_share == 0.0
