"""Leg kinematics against Pinocchio and the textbook formulas; stacked legs against each leg."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from hexapod_pin.arrays import Array
from hexapod_pin.control.leg_group import LegGroup, leg_group
from hexapod_pin.errors import ReachError, UnknownNameError
from hexapod_pin.robot.leg_geometry import (
    BRANCHES,
    YawPitchPitch,
    closed_form_determinant,
    closed_form_rates,
    joint_rates,
    normalised_determinant,
)
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.robot.robot_source import urdf_path

FEMUR = '<origin xyz="0.0835 0 0" rpy="0 0 0"/>\n    <axis xyz="0 1 0"/>'
REPLACED_FEMUR = {
    "other signs and zeros": '<origin xyz="0.0835 0 0" rpy="0 0.3 0"/>\n    <axis xyz="0 -1 0"/>',
    "intersecting axes": '<origin xyz="0 0 0" rpy="0 0 0"/>\n    <axis xyz="0 1 0"/>',
    "no closed form": '<origin xyz="0.0835 0.012 0" rpy="0 0 0"/>\n    <axis xyz="0 1 0"/>',
}


def variant(folder: Path, femur: str) -> Robot:
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
def kharagpur() -> Robot:
    return load_robot("kharagpur")


def paths(legs: LegGroup, count: int = 80) -> tuple[Array, Array]:
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
    estimate = legs.kinematics.estimated_rates(p_BF, v_BF, q)
    np.testing.assert_allclose(estimate, rates, rtol=1e-9, atol=1e-9)
    determinant = legs.kinematics.normalised_determinant(q)
    np.testing.assert_allclose(determinant, normalised_determinant(jacobian), atol=1e-12)


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


@pytest.mark.parametrize("branch", BRANCHES)
def test_closed_form_rates_hold_on_every_branch(kharagpur: Robot, branch: tuple[int, int]) -> None:
    """Also folded over the yaw axis, where only targets near that axis are reached."""
    leg = LegKinematics.of(kharagpur, "rm")
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


L1, L2, L3 = 0.0835, 0.11934, 0.09879  # S2 Table 1 [m]


@pytest.fixture(scope="module")
def s2_leg(kharagpur: Robot) -> LegKinematics:
    return LegKinematics.of(kharagpur, "lm")


def random_angles(count: int, seed: int = 1) -> Array:
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, 3))


def turns_apart(a: Array, b: Array) -> Array:
    return np.asarray(np.mod(a - b + np.pi, 2 * np.pi) - np.pi)


@pytest.mark.parametrize(("robot", "name"), [("kharagpur", "lf"), ("athena", "rm")])
def test_forward_and_jacobian_equal_pinocchio(robot: str, name: str) -> None:
    owner = load_robot(robot)
    leg, model, q = LegKinematics.of(owner, name), owner.model, pin.neutral(owner.model)
    rows = np.array([owner.joint_index(joint) for joint in owner.leg(name).joints])
    frame, data = model.getFrameId(f"{name}_foot"), model.createData()
    for angles in random_angles(30):
        q[7 + rows] = angles
        whole = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
        pin.framesForwardKinematics(model, data, q)
        np.testing.assert_allclose(leg.forward(angles), data.oMf[frame].translation, atol=1e-15)
        np.testing.assert_allclose(leg.jacobian(angles), whole[:3, 6 + rows], atol=1e-15)
    seen, drawn = set(), random_angles(300, seed=2)
    for angles in drawn[np.linalg.cond(leg.jacobian(drawn)) < 50]:
        target = leg.forward(angles)
        found = leg.branches(target)
        seen.add(len(found))
        np.testing.assert_allclose(leg.forward(found), np.tile(target, (len(found), 1)), atol=1e-14)
        # Rounding of 1e-16 m times the condition allowed above, over 0.1 m.
        assert np.abs(turns_apart(found, angles)).max(axis=1).min() < 1e-12
    assert seen == {2, 4}


@pytest.mark.parametrize(("name", "side"), [("lf", 1.0), ("rf", -1.0)])
def test_forward_is_the_textbook_formula(kharagpur: Robot, name: str, side: float) -> None:
    """Physics section 7, hip frame x outward; its z axis turned by +-90 degrees to the side."""
    q = random_angles(100)
    c1, s1 = np.cos(q[:, 0]), np.sin(q[:, 0])
    radius = L1 + L2 * np.cos(q[:, 1]) + L3 * np.cos(q[:, 1] + q[:, 2])
    drop = L2 * np.sin(q[:, 1]) + L3 * np.sin(q[:, 1] + q[:, 2])
    hip = np.array([0.2, side * 0.1025, 0.0])
    expected = hip + np.stack([-side * radius * s1, side * radius * c1, -drop], axis=-1)
    leg = LegKinematics.of(kharagpur, name)
    np.testing.assert_allclose(leg.forward(q), expected, atol=1e-15)


def test_branches_are_different_and_ordered(s2_leg: LegKinematics) -> None:
    target = s2_leg.forward([0.3, 1.2, 1.8])
    found = s2_leg.branches(target)
    assert found.shape == (4, 3)
    assert list(np.sign(found[:, 2])) == [1, -1, 1, -1]
    assert np.abs(turns_apart(found[2:, 0], found[:2, 0] + np.pi)).max() < 1e-12
    target = s2_leg.forward([0.1, -0.2, 1.4])
    for branch in s2_leg.branches(target):
        near = branch + [0.1, -0.1, 0.1]
        np.testing.assert_allclose(s2_leg.inverse(target, near=near, limits=False), branch)


def test_inverse_of_a_path_is_the_path(s2_leg: LegKinematics) -> None:
    s = np.linspace(0.0, 1.0, 400)
    q = np.stack([2.0 + 3.0 * s, -0.4 + 0.5 * np.sin(5 * s), 1.2 + 0.5 * np.cos(4 * s)], axis=-1)
    again = s2_leg.inverse(s2_leg.forward(q), near=q[0], limits=False)
    np.testing.assert_allclose(again, q, atol=1e-13)
    posture = s2_leg.posture
    np.testing.assert_allclose(s2_leg.inverse(s2_leg.forward(posture)), posture, atol=1e-13)


def test_a_straight_knee(s2_leg: LegKinematics) -> None:
    """Reached without NaN; HC38b: its singular values (its tibia zero is 90 degrees off)."""
    straight = np.array([0.2, -0.3, 0.0])
    found = s2_leg.branches(s2_leg.forward(straight))
    # An ulp of the target turns a straight knee by sqrt(2 ulp (L2 + L3) / (L2 L3)) < 1e-7.
    np.testing.assert_allclose(found[:2], np.tile(straight, (2, 1)), atol=1e-7)
    values = np.linalg.svd(s2_leg.jacobian([0.0, -0.3, 0.0]), compute_uv=False)
    np.testing.assert_allclose(values[:2], [0.2918875483729684, 0.23945805687009145], rtol=1e-12)
    assert values[2] < 1e-15


def test_excess_of_targets_out_of_reach(s2_leg: LegKinematics) -> None:
    """On the femur axis itself: L2 - L3 short of the reach; folded, 2 L1 from it, it reaches."""
    for beyond in (1e-9, 0.2):
        target = np.array([0.0, 0.1025 + L1 + L2 + L3 + beyond, 0.0])
        with refused(ReachError, leg="lm", about=("0.0206", "0.2181", "lm_femur_joint")) as no:
            s2_leg.inverse(target)
        assert no.value.excess == pytest.approx(beyond, abs=1e-15)
        assert s2_leg.excess(target) == pytest.approx(beyond, abs=1e-15)
        with pytest.raises(ReachError):
            s2_leg.branches(target)
    target = np.array([[0.0, 0.1025 + L1, 0.0]])
    with pytest.raises(ReachError) as caught:
        s2_leg.inverse(np.vstack([s2_leg.forward(s2_leg.posture), target]), limits=False)
    assert caught.value.excess == pytest.approx(L2 - L3, abs=1e-15)
    inside = s2_leg.excess(s2_leg.forward(random_angles(20).reshape(4, 5, 3)))
    assert inside.shape == (4, 5) and np.abs(inside).max() == 0.0


def test_what_has_no_solution_is_refused(s2_leg: LegKinematics, kharagpur: Robot) -> None:
    target = np.array([0.0, 0.1025, -0.1])
    with refused(ReachError, leg="lm", about=("lm_coxa_joint",)):
        s2_leg.inverse(target, limits=False)
    beside = s2_leg.inverse(target + [0.0, 1e-6, 0.0], limits=False)
    np.testing.assert_allclose(s2_leg.forward(beside), target + [0.0, 1e-6, 0.0], atol=1e-15)
    target = s2_leg.forward([1.3, 0.0, 1.5])
    with refused(ReachError, leg="lm", about=("lm_coxa_joint", "1.3000", "1.0472")):
        s2_leg.inverse(target)
    free = s2_leg.inverse(target, limits=False)
    np.testing.assert_allclose(free, [1.3, 0.0, 1.5], atol=1e-14)
    with refused(ReachError, leg="lm", excess=0.0, about=("finite",)):
        s2_leg.inverse([0.1, np.nan, 0.0])
    with refused(UnknownNameError, kind="leg", name="left"):
        LegKinematics.of(kharagpur, "left")


def test_leg_of_another_shape_is_solved_numerically(tmp_path: Path) -> None:
    """A femur axis 12 mm aside; more such legs are in test_leg_search.py."""
    offset_leg = LegKinematics.of(variant(tmp_path, REPLACED_FEMUR["no closed form"]), "lf")
    assert offset_leg.closed_form is None
    with refused(ReachError, leg="lf", about=("inverse()",)):
        offset_leg.branches(offset_leg.foot)
    s = np.linspace(0.0, 2 * np.pi, 500)
    q = np.stack([0.5 * np.sin(s), 0.3 * np.cos(s), 1.5 + 0.4 * np.sin(2 * s)], axis=-1)
    again = offset_leg.inverse(offset_leg.forward(q), near=q[0])
    np.testing.assert_allclose(again, q, atol=1e-9)
    far = offset_leg.forward([0.0, 0.0, 0.0]) + np.array([0.0, 0.05, 0.0])
    with refused(ReachError, leg="lf") as caught:
        offset_leg.inverse(far, limits=False)
    assert 0.03 < caught.value.excess < 0.06
    assert offset_leg.excess(far) == pytest.approx(caught.value.excess, rel=1e-6)
    assert offset_leg.excess(offset_leg.forward([0.2, 0.1, 1.2])) == 0.0
