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
from hexapod_pin.control.joint_trajectory import JointTrajectory
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


def test_the_plan_follows_the_functions(robot: hp.Robot) -> None:
    """STEP, STEP5, Hermite and waypoints between kinks are polynomials: to rounding."""
    plan = hp.motion.JointMotion(MOTION).plan(robot, 5.0)
    time = np.sort(np.random.default_rng(5).uniform(0.0, 5.0, 2000))
    found = quintic(plan, time)
    for name, given in MOTION.items():
        function = given if isinstance(given, MotionFunction) else hp.motion.Sum(terms=(given,))
        exact = not isinstance(function, hp.motion.Sine | hp.motion.Havsin)
        tolerances = (1e-14, 1e-12, 1e-9) if exact else TOLERANCES
        for values, wanted, tolerance in zip(
            found, function.derivatives(time), tolerances, strict=True
        ):
            found_of_joint = values[:, robot.joint_index(name)]
            np.testing.assert_allclose(found_of_joint, wanted, rtol=0.0, atol=tolerance)


def test_joints_not_named_stand(robot: hp.Robot) -> None:
    plan = hp.motion.JointMotion(MOTION).plan(robot, 2.0)
    others = [robot.joint_index(name) for name in robot.joint_names if name not in MOTION]
    assert len(others) == 12
    assert plan.acceleration is not None
    np.testing.assert_array_equal(
        plan.q[:, others], np.tile(robot.posture[others], (len(plan.q), 1))
    )
    assert not plan.v[:, others].any() and not plan.acceleration[..., others].any()
    np.testing.assert_array_equal(plan.q[:, robot.joint_index("rr_femur_joint")], 0.04)


def test_a_shorter_plan_begins_a_longer_one(robot: hp.Robot) -> None:
    control = hp.motion.JointMotion(MOTION)
    short, long = control.plan(robot, 1.3), control.plan(robot, 6.1)
    assert short.time[-1] > 1.3 and long.time[-1] > 6.1  # moving joints do not stop at the end
    for name in ("time", "q", "v", "acceleration"):
        first, second = getattr(short, name), getattr(long, name)
        np.testing.assert_array_equal(first, second[: len(first)])
    steps = {  # kinks that differ by rounding are one knot
        name: hp.motion.Step(start=0.1, end=end, initial=0.0, final=0.1)
        for name, end in (("lf_coxa_joint", 2.4), ("lm_coxa_joint", np.nextafter(2.4, 3.0)))
    }
    knots = hp.motion.JointMotion(steps).plan(robot, 2.9).time
    np.testing.assert_allclose(knots, [0.0, 0.1, 1.0, 2.0, 2.4, 3.0], atol=1e-12)
    points, time = SetPoints(short), np.array([0.0, 0.4, 1.1])
    wanted = quintic(short, time)
    found = [np.array(one) for one in zip(*(points(t) for t in time), strict=True)]
    for got, right, tolerance in zip(found, wanted, (1e-14, 1e-12, 1e-9), strict=True):
        np.testing.assert_allclose(got, right, atol=tolerance)


HUMP = hp.motion.Hermite(time=(0, 0.8), value=(1.0, 1.0), rate=(0.2535, -0.2535))
FAST = hp.motion.Step(start=0.0, end=0.149, initial=-0.3, final=0.3)


@pytest.mark.parametrize(
    ("motion", "name", "value", "allowed"),
    [
        (3.0, "JointMotion.q[lf_coxa_joint]", 3.0, (-1.0472, 1.0472)),
        # STEP's largest rate is 1.5 of its mean rate
        (FAST, "JointMotion.v[lf_coxa_joint]", pytest.approx(1.5 * 0.6 / 0.149), (-6, 6)),
        # the largest angle lies between knots
        (HUMP, "JointMotion.q[lf_coxa_joint]", pytest.approx(1.0507), (-1.0472, 1.0472)),
        ("a", "JointMotion.motion[lf_coxa_joint]", "a", ()),
        (
            hp.motion.Sine(amplitude=0.1, period=1e-6),
            "JointMotion.plan.duration", 2.0, (1_000_000,),
        ),
    ],
)  # fmt: skip
def test_refusals_name_joint_time_value_and_range(robot, motion, name, value, allowed):
    with refused(ParameterError, name, value, allowed=allowed):
        hp.motion.JointMotion({"lf_coxa_joint": motion}).plan(robot, 2.0)


def test_a_motion_just_inside_its_limits_is_planned(robot: hp.Robot) -> None:
    step = hp.motion.Step(start=0.0, end=0.15, initial=-0.3, final=0.3)
    hp.motion.JointMotion({"lf_coxa_joint": step}).plan(robot, 1.0)
    with refused(UnknownNameError, kind="joint", name="elbow"):
        hp.motion.JointMotion({"elbow": 0.1}).plan(robot, 1.0)


def test_a_motion_of_whole_cycles_is_data(robot: hp.Robot, tmp_path: Path) -> None:
    motion = {"rr_coxa_joint": MOTION["rr_coxa_joint"]}
    moving = hp.motion.JointMotion(motion, cycle_time=0.9, steady_from=0.5, speed=0.1)
    plan = moving.plan(robot, 4.0)
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
    assert again == case and again.controller == control
    with refused(ParameterError, "controller.motions", 1):
        read_controller({"kind": "joint-motion", "motion": {}, "motions": 1})


@pytest.mark.parametrize(
    ("changes", "name", "value", "about"),
    [
        ({"acceleration": None}, "acceleration", None, "'quintic'"),
        ({"kind": "linear"}, "acceleration", (3, 2, 18), "'linear'"),
        ({"acceleration": np.zeros((3, 2, 17))}, "acceleration", (3, 2, 17), "(3, 2, 18)"),
        ({"acceleration": np.full((3, 2, 18), np.inf)}, "acceleration[0, 0, 0]", np.inf, "finite"),
        ({"kind": "septic"}, "kind", "septic", "'quintic'"),
    ],
)
def test_malformed_accelerations_are_refused(robot, changes, name, value, about):
    step = hp.motion.Step(start=0.25, end=0.75, initial=0.0, final=0.1)
    plan = hp.motion.JointMotion({"lf_coxa_joint": step}).plan(robot, 0.9)
    with refused(ParameterError, f"JointTrajectory.{name}", value, about=(about,)):
        dataclasses.replace(plan, **changes)
