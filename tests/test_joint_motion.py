"""Joints that follow functions of time: the plan, what it refuses, and its form as data."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.curves import MotionFunction
from hexapod_pin.control.joint_trajectory import JointTrajectory, trajectory_curve
from hexapod_pin.control.registry import read_controller
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.formulations.set_points import SetPoints


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


LIFT = hp.motion.Sum(
    terms=(
        hp.motion.Step(start=0.13, end=0.77, initial=0.02, final=0.1),
        hp.motion.Step5(start=0.6, end=1.9, initial=0.0, final=-0.07),
    )
)
MOTION: dict[str, Any] = {
    "lf_coxa_joint": hp.motion.Sine(amplitude=0.3, period=2.4, phase=0.4), "lf_femur_joint": LIFT,
    "rm_coxa_joint": hp.motion.Waypoints(time=(0.31, 1.0, 1.43), value=(0.0, 0.1, 0.05)),
    "rm_femur_joint": hp.motion.Havsin(start=0.4, end=1.7, initial=0.0, final=0.1),
    "rr_coxa_joint": hp.motion.Periodic(
        function=hp.motion.Hermite(
            time=(0.0, 0.5, 0.9), value=(0.2, -0.2, 0.2), rate=(-0.8, -0.8, -0.8),
        ),
        period=0.9, start=0.3,
    ),
    "rr_femur_joint": 0.04,
}  # fmt: skip
"""Joints of kharagpur that move in every way there is."""


def quintic(plan: JointTrajectory, time: Array) -> tuple[Array, Array, Array]:
    """Return angles, rates and accelerations by the power form, solved for on each interval."""
    assert plan.acceleration is not None
    k = np.searchsorted(plan.time, time, side="right") - 1
    h, s = (plan.time[k + 1] - plan.time[k])[:, None], (time - plan.time[k])[:, None]
    q0, v0, a0 = plan.q[k], plan.v[k], plan.acceleration[k, 0]
    q1, v1, a1 = plan.q[k + 1], plan.v[k + 1], plan.acceleration[k, 1]
    miss_q, miss_v = q1 - q0 - v0 * h - a0 * h**2 / 2, v1 - v0 - a0 * h
    miss_a = a1 - a0
    c3 = (10 * miss_q - 4 * miss_v * h + miss_a * h**2 / 2) / h**3
    c4 = (-15 * miss_q + 7 * miss_v * h - miss_a * h**2) / h**4
    c5 = (6 * miss_q - 3 * miss_v * h + miss_a * h**2 / 2) / h**5
    return (
        q0 + v0 * s + a0 * s**2 / 2 + c3 * s**3 + c4 * s**4 + c5 * s**5,
        v0 + a0 * s + 3 * c3 * s**2 + 4 * c4 * s**3 + 5 * c5 * s**4,
        a0 + 6 * c3 * s + 12 * c4 * s**2 + 20 * c5 * s**3,
    )


TOLERANCES = (1e-11 * 0.3, 4e-10, 1e-7)
"""1e-11 of the largest amplitude [rad]; measured rates and accelerations: 3.0e-10 and 6.2e-8."""


@pytest.mark.parametrize("name", MOTION)
def test_the_plan_follows_the_functions(robot: hp.Robot, name: str) -> None:
    plan = hp.motion.JointMotion(MOTION).plan(robot, 5.0)
    time = np.sort(np.random.default_rng(5).uniform(0.0, 5.0, 2000))
    joint, function = robot.joint_index(name), MOTION[name]
    if not isinstance(function, MotionFunction):
        function = hp.motion.Sum(terms=(function,))
    found = quintic(plan, time)
    for values, wanted, tolerance in zip(
        found, function.derivatives(time), TOLERANCES, strict=True
    ):
        np.testing.assert_allclose(values[:, joint], wanted, rtol=0.0, atol=tolerance)


def test_polynomials_are_followed_to_rounding(robot: hp.Robot) -> None:
    """STEP, STEP5, Hermite and waypoints between kinks are polynomials of degree 5 or less."""
    exact = {
        k: f for k, f in MOTION.items() if not isinstance(f, hp.motion.Sine | hp.motion.Havsin)
    }
    plan = hp.motion.JointMotion(exact).plan(robot, 5.0)
    assert len(plan.time) < 40
    time = np.linspace(0.0, 5.0, 3001)
    angles, rates, bends = quintic(plan, time)
    for name, function in exact.items():
        if isinstance(function, MotionFunction):
            column, (q, v, a) = robot.joint_index(name), function.derivatives(time)
            np.testing.assert_allclose(angles[:, column], q, atol=1e-14)
            np.testing.assert_allclose(rates[:, column], v, atol=1e-12)
            away = np.abs(time[:, None] - plan.time).min(axis=1) > 1e-9
            np.testing.assert_allclose(bends[away, column], a[away], atol=1e-9)


def test_joints_not_named_stand(robot: hp.Robot) -> None:
    """A cubic may know its accelerations and does not follow them."""
    plan = hp.motion.JointMotion(MOTION).plan(robot, 2.0)
    others = [robot.joint_index(name) for name in robot.joint_names if name not in MOTION]
    assert len(others) == 12
    assert plan.acceleration is not None
    np.testing.assert_array_equal(
        plan.q[:, others], np.tile(robot.posture[others], (len(plan.q), 1))
    )
    assert not plan.v[:, others].any() and not plan.acceleration[..., others].any()
    np.testing.assert_array_equal(plan.q[:, robot.joint_index("rr_femur_joint")], 0.04)
    plan = hp.HoldPosture().plan(robot, 1.0)
    given = JointTrajectory(**fields(plan, acceleration=np.ones((1, 2, 18))))
    np.testing.assert_array_equal(trajectory_curve(given)(0.5), robot.posture)


def test_accelerations_are_one_sided(robot: hp.Robot) -> None:
    """STEP's acceleration jumps from 0 to 6 (x1 - x0) / (t1 - t0)^2 and ends at minus that."""
    step = hp.motion.Step(start=0.25, end=0.75, initial=0.0, final=0.1)
    plan = hp.motion.JointMotion({"lf_coxa_joint": step}).plan(robot, 0.9)
    assert plan.acceleration is not None
    np.testing.assert_array_equal(plan.time, [0.0, 0.25, 0.75, 1.0])
    np.testing.assert_allclose(
        plan.acceleration[:, :, robot.joint_index("lf_coxa_joint")],
        [[0.0, 0.0], [2.4, -2.4], [0.0, 0.0]], rtol=1e-14,
    )  # fmt: skip


def test_a_shorter_plan_begins_a_longer_one(robot: hp.Robot) -> None:
    """Set-points of the formulations are the same curve."""
    control = hp.motion.JointMotion(MOTION)
    short, long = control.plan(robot, 1.3), control.plan(robot, 6.1)
    assert short.time[-1] > 1.3 and long.time[-1] > 6.1  # moving joints do not stop at the end
    for name in ("time", "q", "v", "acceleration"):
        first, second = getattr(short, name), getattr(long, name)
        np.testing.assert_array_equal(first, second[: len(first)])
    plan = hp.motion.JointMotion(MOTION).plan(robot, 3.0)
    points, time = SetPoints(plan), np.array([0.0, 0.4, 1.1, 2.9999])
    wanted = quintic(plan, time)
    found = [np.array(one) for one in zip(*(points(t) for t in time), strict=True)]
    for got, right, tolerance in zip(found, wanted, (1e-14, 1e-12, 1e-9), strict=True):
        np.testing.assert_allclose(got, right, atol=tolerance)


def test_kinks_that_differ_by_rounding_are_one_knot(robot: hp.Robot) -> None:
    third = 2.4 / 3.0
    steps = {
        "lf_coxa_joint": hp.motion.Step(start=0.1, end=3 * third, initial=0.0, final=0.1),
        "lm_coxa_joint": hp.motion.Step(
            start=0.1, end=np.nextafter(2.4, 3.0), initial=0.0, final=0.1
        ),
    }
    plan = hp.motion.JointMotion(steps).plan(robot, 2.9)
    np.testing.assert_allclose(plan.time, [0.0, 0.1, 1.0, 2.0, 2.4, 3.0], atol=1e-12)
    early = hp.motion.Step(start=0.1, end=1.0 - 1e-13, initial=0.0, final=0.1)
    for end, last in ((1.0 - 1e-12, 2.0), (0.9, 1.0)):
        plan = hp.motion.JointMotion({"lf_coxa_joint": early}).plan(robot, end)
        np.testing.assert_array_equal(plan.time, [0.0, 0.1, 1.0, 2.0][: 3 + (last > 1.0)])


@pytest.mark.parametrize(
    ("motion", "name", "value", "allowed"),
    [
        ({"lf_coxa_joint": 3.0}, "JointMotion.q[lf_coxa_joint]", 3.0, (-1.0472, 1.0472)),
        (
            {"lf_coxa_joint": hp.motion.Step(start=0, end=0.01, initial=0, final=0.3)},
            "JointMotion.v[lf_coxa_joint]",
            pytest.approx(45.0),
            (-6, 6),
        ),
        (  # the largest angle, 1.0507 rad, lies between knots
            {
                "rf_coxa_joint": hp.motion.Hermite(
                    time=(0, 0.8), value=(1.0, 1.0), rate=(0.2535, -0.2535)
                )
            },
            "JointMotion.q[rf_coxa_joint]",
            pytest.approx(1.0507),
            (-1.0472, 1.0472),
        ),
        ({"lf_coxa_joint": "a"}, "JointMotion.motion[lf_coxa_joint]", "a", ()),
        ({"lf_coxa_joint": float("nan")}, "JointMotion.motion[lf_coxa_joint]", float("nan"), ()),
        (
            {"lf_coxa_joint": hp.motion.Sine(amplitude=0.1, period=1e-6)},
            "JointMotion.plan.duration",
            2.0,
            (1_000_000,),
        ),
    ],
)
def test_refusals_name_joint_time_value_and_range(robot, motion, name, value, allowed):
    with refused(ParameterError, name, value, allowed=allowed):
        hp.motion.JointMotion(motion).plan(robot, 2.0)


def test_a_motion_just_inside_its_limits_is_planned(robot: hp.Robot) -> None:
    """STEP's largest rate is 1.5 of its mean rate: 6 rad/s here, the limit."""
    step = hp.motion.Step(start=0.0, end=0.15, initial=-0.3, final=0.3)
    hp.motion.JointMotion({"lf_coxa_joint": step}).plan(robot, 1.0)
    faster = step.model_copy(update={"end": 0.149})
    name, rate = "JointMotion.v[lf_coxa_joint]", 1.5 * 0.6 / 0.149
    with refused(ParameterError, name, pytest.approx(rate), allowed=(-6, 6)):
        hp.motion.JointMotion({"lf_coxa_joint": faster}).plan(robot, 1.0)
    with refused(UnknownNameError, kind="joint", name="elbow"):
        hp.motion.JointMotion({"elbow": 0.1}).plan(robot, 1.0)


def test_a_motion_of_whole_cycles_is_data(robot: hp.Robot, tmp_path: Path) -> None:
    motion = {"rr_coxa_joint": MOTION["rr_coxa_joint"]}
    plan = hp.motion.JointMotion(motion, cycle_time=0.9, steady_from=0.5, speed=0.1).plan(
        robot, 4.0
    )
    assert (plan.cycle_time, plan.steady_from, plan.speed) == (0.9, 0.5, 0.1)
    assert plan.steady_until == pytest.approx(0.5 + 3 * 0.9, abs=1e-12)
    with refused(ParameterError, "JointMotion.cycle_time", 0.8, about=("rr_coxa_joint",)):
        hp.motion.JointMotion(motion, cycle_time=0.8).plan(robot, 4.0)
    for name, bad in {"cycle_time": 0.0, "steady_from": -1.0, "speed": float("inf")}.items():
        with refused(ParameterError, f"JointMotion.{name}", bad):
            hp.motion.JointMotion(motion, **{name: bad})
    control = hp.motion.JointMotion(MOTION, steady_from=0.5)
    assert read_controller(control.to_dict()) == control
    case = hp.Case(hp.Scene(robot), control, duration=2.0)
    again = hp.load_case(case.save(tmp_path / "case.toml"))
    assert again == case
    assert again.controller == control
    with refused(ParameterError, "controller.motions", 1):
        read_controller({"kind": "joint-motion", "motion": {}, "motions": 1})


def fields(plan: JointTrajectory, **changes: Any) -> dict[str, Any]:
    """Return the fields of a trajectory, with changes."""
    return {**{f.name: getattr(plan, f.name) for f in dataclasses.fields(plan)}, **changes}


@pytest.mark.parametrize(
    ("changes", "name", "value", "about"),
    [
        ({"acceleration": None}, "acceleration", None, "'quintic'"),
        ({"kind": "linear"}, "acceleration", (3, 2, 18), "'linear'"),
        ({"kind": "held"}, "acceleration", (3, 2, 18), "'held'"),
        ({"acceleration": np.zeros((3, 2, 17))}, "acceleration", (3, 2, 17), "(3, 2, 18)"),
        (
            {"acceleration": np.full((3, 2, 18), np.inf)},
            "acceleration[0, 0, 0]", np.inf, "finite",
        ),
        ({"kind": "septic"}, "kind", "septic", "'quintic'"),
    ],
)  # fmt: skip
def test_malformed_accelerations_are_refused(robot, changes, name, value, about):
    step = hp.motion.Step(start=0.25, end=0.75, initial=0.0, final=0.1)
    plan = hp.motion.JointMotion({"lf_coxa_joint": step}).plan(robot, 0.9)
    with refused(ParameterError, f"JointTrajectory.{name}", value, about=(about,)):
        JointTrajectory(**fields(plan, **changes))


def test_extremes_are_those_of_a_dense_search(robot: hp.Robot) -> None:
    """Random splines, scaled so that their largest rate is just below, then above, the limit."""
    random, joint = np.random.default_rng(8), "lf_coxa_joint"
    limit = robot.velocity_limit[robot.joint_index(joint)]
    for _ in range(10):
        time = np.cumsum(random.uniform(0.02, 0.1, 6))
        value = random.uniform(-0.1, 0.1, 6)
        dense = np.linspace(time[0], time[-1], 200_001)
        largest = np.abs(hp.motion.Waypoints(time=time, value=value).value_and_rate(dense)[1]).max()
        for share, beyond in ((1.0 - 1e-7, False), (1.0 + 1e-7, True)):
            scaled = hp.motion.Waypoints(time=time, value=value * share * limit / largest)
            motion = hp.motion.JointMotion({joint: scaled})
            if not beyond:
                motion.plan(robot, 3.0)
                continue
            with refused(ParameterError, allowed=(limit,), about=(joint, "rad/s")) as caught:
                motion.plan(robot, 3.0)
            assert abs(caught.value.value) == pytest.approx(limit, rel=1e-6)
