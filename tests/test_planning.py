"""Fast plans: stacked legs, one table of knots for any length, a gait checked once per robot."""

from __future__ import annotations

import dataclasses
import gc
import tracemalloc
import weakref
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hexapod_pin.arrays import Array
from hexapod_pin.control import KinematicControl, gait_refusal
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import LEG_ORDER, Gait
from hexapod_pin.control.knot_table import knot_times, sample_knots
from hexapod_pin.control.six_legs import SixLegs, six_legs
from hexapod_pin.errors import GaitError, ReachError
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.leg_set import LegSet
from hexapod_pin.robot.leg_velocity import (
    closed_form_determinant,
    closed_form_rates,
    joint_rates,
    normalised_determinant,
)
from hexapod_pin.robot.robot import Robot, load_robot, urdf_path
from hexapod_pin.robot.yaw_pitch_pitch import BRANCHES, YawPitchPitch

FEMUR = '<origin xyz="0.0835 0 0" rpy="0 0 0"/>\n    <axis xyz="0 1 0"/>'
REPLACED_FEMUR = {
    "other signs and zeros": '<origin xyz="0.0835 0 0" rpy="0 0.3 0"/>\n    <axis xyz="0 -1 0"/>',
    "intersecting axes": '<origin xyz="0 0 0" rpy="0 0 0"/>\n    <axis xyz="0 1 0"/>',
    "no closed form": '<origin xyz="0.0835 0.012 0" rpy="0 0 0"/>\n    <axis xyz="0 1 0"/>',
}
GAITS = {
    "tripod": Gait.tripod(stroke=0.08, cycle_time=1.6),
    "tetrapod": Gait.tetrapod(stroke=0.1),
    "turning": Gait.ripple(stroke=0.05, turn_rate=0.1, heading=0.5),
    "no event at whole cycles": Gait.custom((0.1, 0.4, 0.7, 0.6, 0.9, 0.2), 0.71, stroke=0.06),
}
every_gait = pytest.mark.parametrize("gait", GAITS.values(), ids=GAITS.keys())


def variant(folder: Path, femur: str) -> Robot:
    """Return S2's robot with other femur joints."""
    text = urdf_path("kharagpur").read_text()
    assert text.count(FEMUR) == 6
    path = folder / "variant.urdf"
    path.write_text(text.replace(FEMUR, femur))
    return load_robot(path)


@pytest.fixture(scope="module", params=["kharagpur", "athena", *REPLACED_FEMUR])
def legs(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> SixLegs:
    """The legs of both robots and of odd geometries."""
    if request.param not in REPLACED_FEMUR:
        return six_legs(load_robot(request.param))
    return six_legs(variant(tmp_path_factory.mktemp("legs"), REPLACED_FEMUR[request.param]))


@pytest.fixture(scope="module", params=["kharagpur", "athena"])
def robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


def paths(legs: SixLegs, count: int = 80) -> tuple[Array, Array]:
    """Return foot paths near the standing posture and their velocities, (6, count, 3)."""
    s = np.linspace(0.0, 2.0 * np.pi, count)[:, None]
    around = 0.02 * np.sin(s * [1.0, 2.0, 3.0] + np.arange(18).reshape(6, 1, 3))
    return legs.neutral_feet[:, None] + around, 5.0 * np.roll(around, 7, axis=1)


def test_stacked_legs_equal_each_leg_on_its_own(legs: SixLegs) -> None:
    """The last bits are those of one leg, so that stacking changes no run."""
    p_BF, v_BF = paths(legs)
    q = legs.kinematics.inverse(p_BF)
    jacobian = legs.kinematics.jacobian(q)
    rates = joint_rates(jacobian, v_BF)
    for index, leg in enumerate(legs.legs):
        np.testing.assert_array_equal(q[index], leg.inverse(p_BF[index]))
        np.testing.assert_array_equal(jacobian[index], leg.jacobian(q[index]))
        np.testing.assert_array_equal(rates[index], joint_rates(jacobian[index], v_BF[index]))
        np.testing.assert_allclose(leg.forward(q[index]), p_BF[index], atol=1e-9)


def test_estimated_rates_and_determinant_are_those_of_the_jacobian(legs: SixLegs) -> None:
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
    """A robot that stands with its knees the other way keeps them that way."""
    inf = np.full(len(robot.joint_names), np.inf)
    posture = robot.posture.copy()
    for name in LEG_ORDER:
        leg = LegKinematics.of(robot, name)
        found = leg.branches(leg.forward(leg.posture))
        posture[[robot.joint_index(joint) for joint in leg.joints]] = found[1]
    other = dataclasses.replace(robot, posture=posture, lower=-inf, upper=inf)
    for standing in (robot, other):
        legs = six_legs(standing)
        q = legs.kinematics.inverse(paths(legs)[0])
        expected = np.stack([leg.posture for leg in legs.legs])[:, None]
        assert np.abs(q - expected).max() < 0.8
    assert np.abs(six_legs(robot).kinematics.posture - six_legs(other).kinematics.posture).max() > 1


def test_angles_go_on_from_a_reference_by_whole_turns(robot: Robot) -> None:
    inf = np.full(len(robot.joint_names), np.inf)
    legs = six_legs(dataclasses.replace(robot, lower=-inf, upper=inf)).kinematics
    p_BF = paths(six_legs(robot))[0]
    turned = legs.inverse(p_BF, near=legs.posture + [2.0 * np.pi, 0.0, -2.0 * np.pi])
    expected = legs.inverse(p_BF) + [2.0 * np.pi, 0.0, -2.0 * np.pi]
    np.testing.assert_allclose(turned, expected, atol=1e-14)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda legs, p: p.__setitem__((4, 30), p[4, 30] + [0.0, 0.0, -1.0]),
        lambda legs, p: p.__setitem__((4, 30, 1), np.nan),
        lambda legs, p: p.__setitem__((4, 30), legs.legs[4].forward([1.5, 0.0, 1.5])),
        lambda legs, p: p.__setitem__((4, 30, slice(2)), legs.legs[4].origins[0][:2]),
    ],
    ids=["too far", "not finite", "beyond a joint limit", "on the yaw axis"],
)
def test_refused_path_has_the_error_of_its_leg(
    spoil: Callable[[SixLegs, Array], None],
) -> None:
    legs = six_legs(load_robot("kharagpur"))
    p_BF = paths(legs)[0]
    spoil(legs, p_BF)
    with pytest.raises(ReachError) as alone:
        legs.legs[4].inverse(p_BF[4])
    with pytest.raises(ReachError) as stacked:
        legs.kinematics.inverse(p_BF)
    assert (str(stacked.value), stacked.value.leg) == (str(alone.value), "rm")
    assert stacked.value.excess == alone.value.excess


def test_one_leg_without_closed_form_makes_all_go_one_by_one(tmp_path: Path) -> None:
    """A stack of legs of both kinds."""
    odd = LegKinematics.of(variant(tmp_path, REPLACED_FEMUR["no closed form"]), "lf")
    plain = LegKinematics.of(load_robot("kharagpur"), "lm")
    mixed = LegSet.of([plain, odd])
    assert mixed.closed_form is None
    p_BF = np.stack([leg.forward(leg.posture) for leg in (plain, odd)])[:, None]
    p_BF = p_BF + 0.01 * np.sin(np.arange(20))[:, None]
    q = mixed.inverse(p_BF)
    for leg, own, target in zip((plain, odd), q, p_BF, strict=True):
        np.testing.assert_allclose(leg.forward(own), target, atol=1e-9)


def test_positions_and_velocities_together_are_those_apart(robot: Robot) -> None:
    path = FootPath(GAITS["turning"], six_legs(robot).neutral_feet, stop_at=16.8)
    time = np.linspace(0.0, 20.0, 777)
    p_BF, v_BF = path.positions_and_velocities(time)
    np.testing.assert_array_equal(p_BF, path.positions(time))
    np.testing.assert_array_equal(v_BF, path.velocities(time))
    few = [0, 300, 776]  # footholds far apart are not tabulated
    np.testing.assert_array_equal(path.positions(time[few]), p_BF[few])
    assert path.positions(np.zeros(0)).shape == (0, 6, 3)


def test_knots_part_every_span_as_linspace_does() -> None:
    events = np.array([0.0, 0.4, 0.400001, 1.7, 2.0])
    time, first = knot_times(events, 0.01)
    np.testing.assert_array_equal(time[first], events)
    for index, (begin, end) in enumerate(zip(events[:-1], events[1:], strict=True)):
        count = first[index + 1] - first[index]
        expected = np.linspace(begin, end, count, endpoint=False)
        np.testing.assert_array_equal(time[first[index] : first[index + 1]], expected)
    assert np.diff(time).max() <= 0.01 * (1.0 + 1e-9)


def directly(robot: Robot, gait: Gait, duration: float, stop_at: float | None) -> list[Array]:
    """Return times, angles and rates of a plan without any table: one evaluation of all knots."""
    legs = six_legs(robot)
    path = FootPath(gait, legs.neutral_feet, stop_at=stop_at)
    spacing = 0.01
    while True:
        time, _ = knot_times(np.array([0.0, *path.events(duration), duration]), spacing)
        knots = sample_knots(legs, path, time)
        if knots.error.max() <= 0.5e-6:
            return [knots.time, knots.q, knots.v]
        spacing *= 0.5


@every_gait
@pytest.mark.parametrize("cycles", [0.003, 0.4, 1.0, 2.2, 3.0, 3.05, 4.0, 6.6, 11.35])
def test_plan_from_the_table_equals_one_without(robot: Robot, gait: Gait, cycles: float) -> None:
    """To the last bit until the first steady cycle ends, and to rounding from there on."""
    duration = cycles * gait.cycle_time
    plan = KinematicControl(gait).plan(robot, duration)
    own, expected = (plan.time, plan.q, plan.v), directly(robot, gait, duration, None)
    for found, wanted in zip(own, expected, strict=True):
        assert found.shape == wanted.shape
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-12)
        early = plan.time < 3.0 * gait.cycle_time - 1e-6
        np.testing.assert_array_equal(found[early], wanted[early])


@every_gait
@pytest.mark.parametrize("stop", [3.25, 4.0, 9.3])
@pytest.mark.parametrize("cycles", [0.5, 3.1, 8.0, 11.0])
def test_plan_that_stops_equals_one_without_table(
    robot: Robot, gait: Gait, stop: float, cycles: float
) -> None:
    duration, stop_at = cycles * gait.cycle_time, stop * gait.cycle_time
    plan = KinematicControl(gait, stop_at=stop_at).plan(robot, duration)
    expected = directly(robot, gait, duration, stop_at)
    for found, wanted in zip((plan.time, plan.q, plan.v), expected, strict=True):
        assert found.shape == wanted.shape
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-12)


def test_steady_cycles_are_the_same_to_the_bit(robot: Robot) -> None:
    gait = GAITS["tetrapod"]
    plan = KinematicControl(gait).plan(robot, 20.0 * gait.cycle_time)
    cycle = int(np.searchsorted(plan.time, 3.0 * gait.cycle_time - 1e-6))
    cycle -= int(np.searchsorted(plan.time, 2.0 * gait.cycle_time - 1e-6))
    steady = plan.q[-1 - 17 * cycle : -1 - cycle]
    np.testing.assert_array_equal(steady[cycle:], steady[:-cycle])


def test_legs_of_another_shape_walk_for_many_cycles(tmp_path: Path) -> None:
    robot = variant(tmp_path, REPLACED_FEMUR["no closed form"])
    gait = Gait.tetrapod(stroke=0.06, cycle_time=1.5)
    plan = KinematicControl(gait).plan(robot, 10.0)
    _, q, v = directly(robot, gait, 10.0, None)
    np.testing.assert_allclose(plan.q, q, atol=1e-8)  # Newton's tolerance of 1e-9 m over 0.1 m
    np.testing.assert_allclose(plan.v, v, atol=1e-7)


def test_an_hour_takes_little_more_memory_than_its_knots(robot: Robot) -> None:
    control = KinematicControl(GAITS["tetrapod"])
    control.plan(robot, 10.0)
    peaks = []
    for duration in (600.0, 3600.0):
        gc.collect()
        tracemalloc.start()
        plan = control.plan(robot, duration)
        own = plan.time.nbytes + plan.q.nbytes + plan.v.nbytes
        peaks.append(tracemalloc.get_traced_memory()[1] / own)
        tracemalloc.stop()
        assert len(plan.time) == pytest.approx(duration / 0.01, rel=0.02)
    assert max(peaks) < 1.3


def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Record the name of every gait that is really checked."""
    checked: list[str] = []
    check = gait_refusal.violation

    def violation(legs: SixLegs, gait: Gait) -> object:
        checked.append(gait.name)
        return check(legs, gait)

    monkeypatch.setattr(gait_refusal, "violation", violation)
    return checked


def test_a_gait_is_checked_once_for_a_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    checked = counted(monkeypatch)
    robot = load_robot("kharagpur")
    for duration in (1.0, 2.0, 30.0):
        KinematicControl(Gait.tripod(name="first", stroke=0.1)).plan(robot, duration)
    KinematicControl(Gait.tripod(name="first", stroke=0.1), stop_at=20.0).plan(robot, 2.0)
    assert checked == ["first"]
    KinematicControl(Gait.tripod(name="second", stroke=0.09)).plan(robot, 1.0)
    assert checked == ["first", "second"]
    KinematicControl(Gait.tripod(name="first", stroke=0.1)).plan(load_robot("kharagpur"), 1.0)
    assert checked == ["first", "second", "first"]


def test_a_refusal_is_found_once_and_raised_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    checked = counted(monkeypatch)
    robot, control = load_robot("kharagpur"), KinematicControl(Gait.tripod(stroke=0.8))
    refusals = []
    for _ in range(2):
        with pytest.raises(GaitError) as refused:
            control.plan(robot, 1.0)
        refusals.append(refused.value)
    evaluations = len(checked)
    with pytest.raises(GaitError):
        control.plan(robot, 3.0)
    assert len(checked) == evaluations > 1
    first, second = refusals
    assert first is not second
    assert str(first) == str(second)
    assert (first.quantity, first.limit) == (second.quantity, second.limit)


def test_narrower_limits_are_another_robot() -> None:
    """What was found for a robot does not serve one with other joint limits."""
    robot, gait = load_robot("kharagpur"), Gait.tetrapod()
    KinematicControl(gait).plan(robot, 1.0)
    slow = dataclasses.replace(robot, velocity=np.full(len(robot.joint_names), 0.1))
    with pytest.raises(GaitError, match="would turn at"):
        KinematicControl(gait).plan(slow, 1.0)


def test_a_robot_is_not_kept_alive_by_its_plans() -> None:
    robot = load_robot("athena")
    KinematicControl(GAITS["tripod"]).plan(robot, 2.0)
    alive = weakref.ref(robot)
    del robot
    gc.collect()
    assert alive() is None
