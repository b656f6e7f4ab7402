"""Stacked legs against each leg on its own: inverse kinematics, rates, branches, refusals."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from hexapod_pin.arrays import Array
from hexapod_pin.control.gait import LEG_ORDER
from hexapod_pin.control.leg_group import LegGroup, leg_group
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.leg_geometry import (
    BRANCHES,
    YawPitchPitch,
    closed_form_determinant,
    closed_form_rates,
    joint_rates,
    normalised_determinant,
)
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.leg_set import LegSet
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.robot.robot_source import urdf_path

FEMUR = '<origin xyz="0.0835 0 0" rpy="0 0 0"/>\n    <axis xyz="0 1 0"/>'
REPLACED_FEMUR = {
    "other signs and zeros": '<origin xyz="0.0835 0 0" rpy="0 0.3 0"/>\n    <axis xyz="0 -1 0"/>',
    "intersecting axes": '<origin xyz="0 0 0" rpy="0 0 0"/>\n    <axis xyz="0 1 0"/>',
    "no closed form": '<origin xyz="0.0835 0.012 0" rpy="0 0 0"/>\n    <axis xyz="0 1 0"/>',
}


def variant(folder: Path, femur: str) -> Robot:
    """Return S2's robot with other femur joints."""
    text = urdf_path("kharagpur").read_text()
    assert text.count(FEMUR) == 6
    path = folder / "variant.urdf"
    path.write_text(text.replace(FEMUR, femur))
    return load_robot(path)


@pytest.fixture(scope="module", params=["kharagpur", "athena", *REPLACED_FEMUR])
def legs(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> LegGroup:
    if request.param not in REPLACED_FEMUR:
        return leg_group(load_robot(request.param))
    return leg_group(variant(tmp_path_factory.mktemp("legs"), REPLACED_FEMUR[request.param]))


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("athena")


def paths(legs: LegGroup, count: int = 80) -> tuple[Array, Array]:
    """Return foot paths near the standing posture and their velocities, (6, count, 3)."""
    s = np.linspace(0.0, 2.0 * np.pi, count)[:, None]
    around = 0.02 * np.sin(s * [1.0, 2.0, 3.0] + np.arange(18).reshape(6, 1, 3))
    return legs.neutral_feet[:, None] + around, 5.0 * np.roll(around, 7, axis=1)


def test_stacked_legs_equal_each_leg_on_its_own(legs: LegGroup) -> None:
    p_BF, v_BF = paths(legs)
    q = legs.kinematics.inverse(p_BF)
    jacobian = legs.kinematics.jacobian(q)
    rates = joint_rates(jacobian, v_BF)
    for index, leg in enumerate(legs.legs):
        np.testing.assert_array_equal(q[index], leg.inverse(p_BF[index]))
        np.testing.assert_array_equal(jacobian[index], leg.jacobian(q[index]))
        np.testing.assert_array_equal(rates[index], joint_rates(jacobian[index], v_BF[index]))
        np.testing.assert_allclose(leg.forward(q[index]), p_BF[index], atol=1e-9)


def test_rows_of_the_core_equal_the_stacked_legs(legs: LegGroup) -> None:
    """Control at ticks solves rows in the core; where it could not, a slower path would be used."""
    form = legs.kinematics.closed_form
    if form is None:
        return
    p_BF, _ = paths(legs)
    expected = legs.kinematics.inverse(p_BF)
    rows = np.zeros((p_BF.shape[1], 18))
    for place, q in zip(legs.joint_index, expected, strict=True):
        rows[:, place] = q + 2.0 * np.pi * np.array([0.0, 1.0, -1.0])
    near = rows + 0.1
    free = dataclasses.replace(form, lower=form.lower - 9.0, upper=form.upper + 9.0)
    assert free.row_solver(legs.joint_index)(np.ascontiguousarray(p_BF.swapaxes(0, 1)), near)
    np.testing.assert_allclose(near, rows, rtol=0.0, atol=1e-12)  # some ten roundings


def test_estimated_rates_and_determinant_are_those_of_the_jacobian(legs: LegGroup) -> None:
    p_BF, v_BF = paths(legs)
    q = legs.kinematics.inverse(p_BF)
    jacobian = legs.kinematics.jacobian(q)
    estimate = legs.kinematics.estimated_rates(p_BF, v_BF, q)
    np.testing.assert_allclose(estimate, joint_rates(jacobian, v_BF), rtol=1e-9, atol=1e-9)
    determinant = legs.kinematics.normalised_determinant(q)
    np.testing.assert_allclose(determinant, normalised_determinant(jacobian), atol=1e-12)


@pytest.mark.parametrize("branch", BRANCHES)
def test_closed_form_rates_hold_on_every_branch(robot: Robot, branch: tuple[int, int]) -> None:
    """Also folded over the yaw axis, where only targets near that axis are reached."""
    leg = LegKinematics.of(robot, "rm")
    assert leg.closed_form is not None
    geometry = YawPitchPitch.stack([leg.closed_form])
    generator = np.random.default_rng(8)
    p_BF = leg.forward(generator.uniform(-np.pi, np.pi, (2000, 3)))[None]
    q, outside = geometry.solve(*geometry.to_hip(p_BF), *branch)
    well = normalised_determinant(leg.jacobian(q[0])) > 0.1
    well &= (outside[0] < 0.0) & (geometry.to_hip(p_BF)[1][0] > 0.01)
    assert well.sum() > 50
    p_BF, q = p_BF[:, well], q[:, well]
    v_BF = generator.uniform(-1.0, 1.0, p_BF.shape)
    rates = closed_form_rates(geometry, np.array([[branch[0]]]), p_BF, v_BF, q)
    moved = (leg.jacobian(q[0]) @ rates[0][..., None])[..., 0]
    np.testing.assert_allclose(moved, v_BF[0], atol=1e-11)
    exact = normalised_determinant(leg.jacobian(q[0]))
    np.testing.assert_allclose(closed_form_determinant(geometry, q)[0], exact, atol=1e-12)


def test_branch_is_the_one_nearest_to_the_posture(robot: Robot) -> None:
    inf = np.full(len(robot.joint_names), np.inf)
    posture = robot.posture.copy()
    for name in LEG_ORDER:
        leg = LegKinematics.of(robot, name)
        found = leg.branches(leg.forward(leg.posture))
        posture[[robot.joint_index(joint) for joint in leg.joints]] = found[1]
    other = dataclasses.replace(robot, posture=posture, lower=-inf, upper=inf)
    for standing in (robot, other):
        legs = leg_group(standing)
        q = legs.kinematics.inverse(paths(legs)[0])
        expected = np.stack([leg.posture for leg in legs.legs])[:, None]
        assert np.abs(q - expected).max() < 0.8
    assert np.abs(robot.posture - other.posture).max() > 1


def test_angles_go_on_from_a_reference_by_whole_turns(robot: Robot) -> None:
    inf = np.full(len(robot.joint_names), np.inf)
    legs = leg_group(dataclasses.replace(robot, lower=-inf, upper=inf)).kinematics
    p_BF = paths(leg_group(robot))[0]
    turned = legs.inverse(p_BF, near=legs.posture + [2.0 * np.pi, 0.0, -2.0 * np.pi])
    expected = legs.inverse(p_BF) + [2.0 * np.pi, 0.0, -2.0 * np.pi]
    np.testing.assert_allclose(turned, expected, atol=1e-14)
    legs = leg_group(robot)
    feet = np.swapaxes(paths(legs, 64)[0], 0, 1)
    together = legs.joint_angles(feet)
    alone = np.concatenate([legs.joint_angles(row[None]) for row in feet])
    np.testing.assert_array_equal(together, alone)


@pytest.mark.parametrize("spoiled", ["too far", "not finite", "beyond a limit", "on the yaw axis"])
def test_refused_path_has_the_error_of_its_leg(spoiled: str) -> None:
    legs = leg_group(load_robot("kharagpur"))
    p_BF = paths(legs)[0]
    p_BF[4, 30] = {
        "too far": p_BF[4, 30] + [0.0, 0.0, -1.0], "not finite": np.nan,
        "beyond a limit": legs.legs[4].forward([1.5, 0.0, 1.5]),
        "on the yaw axis": [*legs.legs[4].origins[0][:2], p_BF[4, 30, 2]],
    }[spoiled]  # fmt: skip
    with pytest.raises(ReachError) as alone:
        legs.legs[4].inverse(p_BF[4])
    with pytest.raises(ReachError) as stacked:
        legs.kinematics.inverse(p_BF)
    assert (str(stacked.value), stacked.value.leg) == (str(alone.value), "rm")
    assert stacked.value.excess == alone.value.excess
    with refused(ReachError, leg="rm"):
        legs.joint_angles(np.swapaxes(p_BF, 0, 1))


def test_one_leg_without_closed_form_makes_all_go_one_by_one(tmp_path: Path) -> None:
    odd = LegKinematics.of(variant(tmp_path, REPLACED_FEMUR["no closed form"]), "lf")
    plain = LegKinematics.of(load_robot("kharagpur"), "lm")
    mixed = LegSet.of([plain, odd])
    assert mixed.closed_form is None
    p_BF = np.stack([leg.forward(leg.posture) for leg in (plain, odd)])[:, None]
    p_BF = p_BF + 0.01 * np.sin(np.arange(20))[:, None]
    q = mixed.inverse(p_BF)
    for leg, own, target in zip((plain, odd), q, p_BF, strict=True):
        np.testing.assert_allclose(leg.forward(own), target, atol=1e-9)


def test_the_core_solves_as_the_stacked_legs_do(legs: LegGroup) -> None:
    p_BF, _ = paths(legs, 12)
    rng = np.random.default_rng(3)
    turns = 2.0 * np.pi * rng.integers(-1, 2, (12, len(legs.posture)))
    for near in (np.tile(legs.posture, (12, 1)), legs.posture + turns):
        start = np.swapaxes(near[:, legs.joint_index], 0, 1)
        try:
            wanted = legs.joint_rows(legs.kinematics.inverse_each(p_BF, start), near)
        except ReachError:
            with pytest.raises(ReachError):
                legs.joint_angles(np.swapaxes(p_BF, 0, 1), near)
            continue
        found = legs.joint_angles(np.swapaxes(p_BF, 0, 1), near)
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-12)
