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
from hexapod_pin.formulations.inverse.force_split import least_squares
from hexapod_pin.formulations.rigid import RigidGround, RigidModel
from hexapod_pin.validation.checks import inverse_checks
from hexapod_pin.validation.checks.samples import rigid_robot, six_feet, states

SPLITS = (MinimumNorm(), Compliant(normal=1e5, tangential=3e4, servo=240.0), LeastTorque())


@pytest.mark.parametrize("check", inverse_checks.CHECKS, ids=lambda check: check.name)
def test_statics_against_independent_answers(check) -> None:
    assert check.run() <= check.tolerance


@pytest.mark.parametrize("split", SPLITS, ids=lambda split: split.label)
def test_every_split_balances_a_moving_robot(split) -> None:
    """Torques and forces of a split, put into RNEA with external forces, leave nothing."""
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


def test_splits_are_the_best_of_what_they_minimise() -> None:
    """Any other balanced force is longer, stores more energy, or needs more torque."""
    model = rigid_robot("kharagpur")
    q, still = model.robot.stand().q, np.zeros(24)
    load = stance_load(model, q, still, still, range(6))
    norm, elastic, least = (split.share(load) for split in SPLITS)
    compliance = np.diag(np.tile([1 / 3e4, 1 / 3e4, 1 / 1e5], 6))

    def energy(force):
        return force @ compliance @ force + load.torque(force) @ load.torque(force) / 240.0

    rng, null = np.random.default_rng(4), np.linalg.svd(load.base_rows.T)[2][6:]
    for _ in range(20):
        other = null.T @ (0.3 * rng.normal(size=12))
        assert np.linalg.norm(norm + other) > np.linalg.norm(norm)
        assert energy(elastic + other) > energy(elastic)
        assert np.linalg.norm(load.torque(least + other)) > np.linalg.norm(load.torque(least))
    assert np.linalg.norm(load.torque(least)) < 0.8 * np.linalg.norm(load.torque(norm))


def test_cones_and_limits_bind() -> None:
    """Less friction costs torque, limits hold, and without a solution there is an error."""
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
    # a linear program puts the least possible peak at 0.97014 of this one
    tight = type(load)(**{**vars(load), "effort": np.full(18, 0.98 * peak)})
    kept = load.torque(LeastTorque().share(tight))
    assert np.abs(kept).max() == pytest.approx(0.98 * peak, rel=1e-9)
    assert kept @ kept > free.torque @ free.torque
    nothing = type(load)(**{**vars(load), "effort": np.full(18, 0.97 * peak)})
    with pytest.raises(InfeasibleError):
        LeastTorque().share(nothing)


def test_least_squares_against_a_hand_made_optimum() -> None:
    """The nearest point to (3, 1, 0) with x + y + z = 1, x <= 0.5, z >= 0: (0.5, 0.5, 0)."""
    found = least_squares(
        np.eye(3), np.array([3.0, 1.0, 0.0]), np.ones((1, 3)), np.ones(1),
        np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([-0.5, 0.0]),
    )  # fmt: skip
    assert found == pytest.approx([0.5, 0.5, 0.0], abs=1e-14)
    with pytest.raises(InfeasibleError):
        least_squares(np.eye(2), np.zeros(2), np.ones((1, 2)), np.ones(1), -np.eye(2), np.zeros(2))


def test_pyramid_lies_inside_its_cone_and_touches_it() -> None:
    normal = np.array([0.6, 0.0, 0.8])
    faces = pyramid(normal, 0.5, 8)
    rng = np.random.default_rng(6)
    inside = [f for f in rng.normal(size=(4000, 3)) if (faces @ f >= 0.0).all()]
    for force in inside:
        push = force @ normal
        assert np.linalg.norm(force - push * normal) <= 0.5 * push * (1.0 + 1e-12)
    assert len(inside) > 50
    with refused(ParameterError, "sides", 2, allowed=(3,)):
        pyramid(normal, 0.5, 2)


def test_normal_force_margin_is_zero_at_the_tipping_slope() -> None:
    """HC17: a ten-thousandth of a degree on either side of 64.1336 the sign differs."""
    robot = six_feet((0.0, 0.0, 0.0), 0.12, (0.03, 0.05, 0.06)).robot
    level, still = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), np.zeros(6)
    signs = []
    for degrees in (64.1335, 64.1338):
        angle = math.radians(degrees)
        pull = 9.81 * np.array([-math.sin(angle), 0.0, -math.cos(angle)])
        model = RigidModel(robot, ground=RigidGround(mu=50.0), gravity=pull)
        signs.append(normal_force_margin(stance_load(model, level, still, still, range(6))))
    assert signs[0] > 0.0 > signs[1]


def test_springs_without_a_rest_are_refused() -> None:
    """Gravity upwards: nothing presses the feet down."""
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
    ],
)
def test_split_parameters_are_checked(split, name: str, value: float) -> None:
    with refused(ParameterError, name, value):
        split()


def test_planned_tetrapod_stands_beside_the_static_envelope() -> None:
    """S2's tetrapod on its plan: feet agree on the base, forces carry the weight.

    Joint 2 needs what statics by minimum norm give: 1.31 N m at peak on S2's arcs; on straight
    footholds the feet reach up to 10 % further out.
    """
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
