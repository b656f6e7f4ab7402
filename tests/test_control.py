"""Controllers: the planned reference, and what is refused before anything runs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from refusals import ANY, refused
from scipy.interpolate import CubicHermiteSpline

from hexapod_pin.control import HoldPosture, JointTrajectory, KinematicControl
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import LEG_ORDER, Gait
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.errors import GaitError, ParameterError, UnknownNameError
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.robot import Robot, load_robot

MAKERS: dict[str, Callable[..., Gait]] = {
    "tripod": Gait.tripod, "ripple": Gait.ripple, "tetrapod": Gait.tetrapod,
    "wave 2/3": lambda **fields: Gait.wave(2 / 3, **fields),
    "wave 5/6": lambda **fields: Gait.wave(5 / 6, **fields),
}  # fmt: skip


@pytest.fixture(scope="module")
def kharagpur() -> Robot:
    return load_robot("kharagpur")


def leg_columns(robot: Robot, leg: str) -> list[int]:
    return [robot.joint_index(joint) for joint in robot.leg(leg).joints]


@pytest.mark.parametrize("make", MAKERS)
def test_a_plan_puts_the_feet_on_their_paths(make: str) -> None:
    """At the knots to rounding, between them within a microradian; from standing on."""
    robot = load_robot("athena" if make == "wave 5/6" else "kharagpur")
    gait = MAKERS[make](stroke=0.08, lift=0.03, heading=0.5)
    plan, path = KinematicControl(gait).plan(robot, 10.0), FootPath.of(leg_group(robot), gait)
    assert plan.time[0] == 0.0 and np.diff(plan.time).max() <= 0.01 + 1e-12
    assert 10.0 <= plan.time[-1] < 12.4  # the first event after the end
    np.testing.assert_allclose(plan.q[0], robot.posture, atol=1e-13)
    np.testing.assert_allclose(plan.v[0], 0.0, atol=1e-13)
    assert (plan.cycle_time, plan.steady_from, plan.steady_until) == (2.4, 4.8, 4 * 2.4)
    assert plan.speed == gait.speed
    np.testing.assert_allclose(plan.travel_direction, [np.cos(0.5), np.sin(0.5)])
    p_BF, v_BF = path.positions(plan.time), path.velocities(plan.time)
    time = np.sort(np.random.default_rng(0).uniform(0.0, 10.0, 3000))
    between = CubicHermiteSpline(plan.time, plan.q, plan.v, axis=0)(time)
    p_between = path.positions(time)
    for index, name in enumerate(LEG_ORDER):
        leg, columns = LegKinematics.of(robot, name), leg_columns(robot, name)
        q, v = plan.q[:, columns], plan.v[:, columns]
        np.testing.assert_allclose(leg.forward(q), p_BF[:, index], atol=1e-14)
        moved = (leg.jacobian(q) @ v[..., None])[..., 0]
        np.testing.assert_allclose(moved, v_BF[:, index], atol=1e-13)
        exact = leg.inverse(p_between[:, index])
        np.testing.assert_allclose(between[:, columns], exact, atol=1e-6)


def test_the_steady_window_ends_with_the_stop_or_is_empty(kharagpur: Robot) -> None:
    plan = KinematicControl(Gait.tetrapod(stroke=0.1), stop_at=14.4).plan(kharagpur, 16.0)
    assert plan.time[-1] == pytest.approx(14.4, abs=1e-12)  # the last angles stay
    np.testing.assert_allclose(plan.q[-1] - kharagpur.posture, 0.0, atol=1e-12)
    np.testing.assert_allclose(plan.v[-1], 0.0, atol=1e-12)
    # The first leg prepares 3.25 - 2/3 cycles before the stop: 3.42, so 3 whole cycles.
    assert plan.steady_until == pytest.approx(3 * 2.4)
    plan = KinematicControl(Gait.tripod()).plan(kharagpur, 3.0)
    assert plan.time[-1] == 3.0
    assert plan.steady_until <= plan.steady_from
    with refused(ParameterError, "stop_at", 3.0, allowed=(7.6,)):
        KinematicControl(Gait.tetrapod(), stop_at=3.0).plan(kharagpur, 10.0)


def test_joint_too_fast_names_it_and_the_shortest_cycle(kharagpur: Robot) -> None:
    robot, joint = kharagpur, "lf_coxa_joint"
    fastest = f"{robot.velocity_limit[robot.joint_index(joint)]:g}"
    with refused(GaitError, quantity="cycle_time", about=("leg lf", joint, fastest)) as caught:
        KinematicControl(Gait.tetrapod(cycle_time=0.3)).plan(robot, 3.0)
    limit = caught.value.limit
    assert 0.3 < limit < 2.4
    plan = KinematicControl(Gait.tetrapod(cycle_time=1.0001 * limit)).plan(robot, 4 * limit)
    share = np.abs(plan.v / robot.velocity_limit).max()
    assert 0.995 < share < 1.002  # at the limit; the start of a cycle is sampled elsewhere
    with pytest.raises(GaitError):
        KinematicControl(Gait.tetrapod(cycle_time=0.998 * limit)).plan(robot, 3.0)


def test_joint_limit_names_joint_value_and_range(kharagpur: Robot) -> None:
    row = kharagpur.joint_index("rm_coxa_joint")
    upper = kharagpur.upper.copy()
    upper[row] = np.radians(10)
    narrow = dataclasses.replace(kharagpur, upper=upper)
    about = ("leg rm", "rm_coxa_joint", "0.1745")
    with refused(GaitError, quantity="stroke", about=about) as caught:
        KinematicControl(Gait.tetrapod()).plan(narrow, 10.0)
    limit = caught.value.limit
    # 2 R tan(10 deg) without the overshoot of the swing, which takes up to a tenth.
    assert 0.85 * 2 * 0.20284 * np.tan(np.radians(10)) < limit < 0.0716
    plan = KinematicControl(Gait.tetrapod(stroke=limit)).plan(narrow, 10.0)
    assert plan.q[:, row].max() <= np.radians(10) + 1e-9


@pytest.mark.parametrize(
    ("quantity", "gait", "value", "least", "about"),
    [
        ("stroke", Gait.tripod(), 0.8, 0.1, ("leg lf", "lf_femur_joint")),
        # slow, so that the joints' speed is not what limits it
        ("lift", Gait.tetrapod(stroke=0.05), 0.6, 0.02, ("leg lf", "lf_femur_joint")),
        # on the spot there is no stroke to shorten
        ("turn_rate", Gait.tripod(stroke=0.0), -1.5, -0.1, ("turn_rate",)),
    ],
)
def test_too_much_names_the_leg_and_the_largest(
    kharagpur: Robot, quantity: str, gait: Gait, value: float, least: float, about: tuple[str, ...]
) -> None:
    def plan(asked: float) -> None:
        KinematicControl(gait.model_copy(update={quantity: asked})).plan(kharagpur, 10.0)

    with refused(GaitError, quantity=quantity, about=about) as caught:
        plan(value)
    limit = caught.value.limit
    assert abs(least) < abs(limit) < abs(value)
    plan(0.9999 * limit)
    with pytest.raises(GaitError):
        plan(1.005 * limit)


def test_postures_and_robots_that_cannot_walk_are_refused(kharagpur: Robot) -> None:
    posture = kharagpur.posture.copy()
    posture[[kharagpur.joint_index(f"{leg}_tibia_joint") for leg in LEG_ORDER]] = 0.02
    inf = np.full(18, np.inf)
    endless = {"lower": -inf, "upper": inf, "velocity_limit": inf}
    free = dataclasses.replace(kharagpur, **endless, posture=posture)
    with refused(GaitError, quantity="posture", limit=None, about=("leg lf", "singular")):
        KinematicControl(Gait.tripod(stroke=0.0)).plan(free, 10.0)
    posture = kharagpur.posture.copy()
    posture[kharagpur.joint_index("rr_femur_joint")] -= 0.2
    uneven = dataclasses.replace(kharagpur, posture=posture)
    with refused(GaitError, quantity="posture", limit=None, about=("foot rr 0.02", "foot lf")):
        KinematicControl(Gait.tripod()).plan(uneven, 10.0)
    without = dataclasses.replace(kharagpur, legs=())
    with refused(GaitError, quantity="legs", limit=None, about=("kharagpur", "0", "4", "8")):
        KinematicControl(Gait.tripod()).plan(without, 10.0)


def test_hold_takes_posture_array_or_names(kharagpur: Robot) -> None:
    robot = kharagpur
    some = robot.posture + 0.01 * np.sin(np.arange(18) + 1.0) ** 2
    named = robot.posture.copy()
    named[robot.joint_index("rm_femur_joint")] = 0.2
    given = [(None, robot.posture), (some, some), ({"rm_femur_joint": 0.2}, named)]
    for q, expected in given:
        plan = HoldPosture(q).plan(robot, 3.0)
        np.testing.assert_array_equal(plan.q, np.tile(expected, (2, 1)))
        np.testing.assert_array_equal(plan.v, np.zeros((2, 18)))
        assert (plan.cycle_time, plan.steady_from, plan.steady_until) == (None, 0.0, 3.0)
        assert list(plan.time) == [0.0, 3.0]
    with refused(ParameterError, "HoldPosture.q[lf_tibia_joint]", -0.5):
        HoldPosture({"lf_tibia_joint": -0.5}).plan(kharagpur, 1.0)
    with refused(UnknownNameError, kind="joint", name="elbow"):
        HoldPosture({"elbow": 0.0}).plan(kharagpur, 1.0)
    with refused(ParameterError, "HoldPosture.q", (3,), allowed=(18,)):
        HoldPosture([0.0, 0.0, 0.0]).plan(kharagpur, 1.0)
    with refused(ParameterError, "duration", 0.0):
        HoldPosture().plan(kharagpur, 0.0)


FIELDS: dict[str, Any] = {
    "time": [0.0, 1.0, 2.0], "q": np.ones((3, 2)), "v": np.zeros((3, 2)), "cycle_time": None,
    "steady_from": 0.0, "steady_until": 2.0, "travel_direction": [1.0, 0.0], "speed": 0.0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "name", "value"),
    [
        ({"time": [0.0, 1.0, 1.0]}, "JointTrajectory.time", ANY),
        ({"q": np.full((3, 2), np.nan)}, "JointTrajectory.q[0, 0]", np.nan),
        ({"v": np.zeros((3, 1))}, "JointTrajectory.time, q, v", ((3,), (3, 2), (3, 1))),
    ],
)
def test_malformed_plan_is_refused(changes: dict[str, Any], name: str, value: Any) -> None:
    with refused(ParameterError, name, value):
        JointTrajectory(**{**FIELDS, **changes})
    with refused(ValueError, about=("read-only",)):
        JointTrajectory(**FIELDS).q[0, 0] = 2.0
