"""Functions of time: closed forms, exact derivatives, kinks, sums, repetition, form as data."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
import tomli_w
from refusals import ANY, refused

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.curves import MotionFunction
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.set_points import SetPoints
from hexapod_pin.spec import read_toml

SPAN: dict[str, Any] = {"start": 0.7, "end": 1.9, "initial": 0.25, "final": -0.15}
UP = hp.motion.Step(start=0.0, end=0.3, initial=-0.2, final=0.2)
BACK = hp.motion.Step5(start=0.3, end=0.5, initial=0.0, final=-0.4)


EVERY: dict[str, MotionFunction] = {
    "step": hp.motion.Step(**SPAN),
    "step5": hp.motion.Step5(**SPAN),
    "havsin": hp.motion.Havsin(**SPAN),
    "velocity-step": hp.motion.VelocityStep(**SPAN, ramp_share=0.2),
    "sine": hp.motion.Sine(amplitude=0.3, period=0.8, phase=0.3, mean=0.1),
    "waypoints": hp.motion.Waypoints(time=(0.4, 1.0, 1.3, 2.2), value=(0.1, 0.3, -0.2, 0.0)),
    "hermite": hp.motion.Hermite(
        time=(0.4, 1.0, 2.2), value=(0.1, 0.3, -0.2), rate=(0.5, -0.4, 0.1)
    ),
    "periodic": hp.motion.Periodic(
        function=hp.motion.Sum(terms=(UP, BACK)), period=0.6, start=0.25
    ),
}
every_function = pytest.mark.parametrize("function", EVERY.values(), ids=EVERY)


def away_from_kinks(function: MotionFunction, seed: int, margin: float) -> np.ndarray:
    """Return random times from 0 to 3 s, none within a margin of a kink [s]."""
    time = np.random.default_rng(seed).uniform(0.0, 3.0, 500)
    kinks = np.array([*function.kinks_until(3.0), np.inf])
    return time[np.abs(time[:, None] - kinks).min(axis=1) > margin]


@pytest.mark.parametrize(
    ("kind", "form", "slope", "bend"),
    [
        (hp.motion.Step, lambda s: 3 * s * s - 2 * s * s * s, 1.5, 6.0),
        (hp.motion.Step5, lambda s: 10 * s**3 - 15 * s**4 + 6 * s**5, 1.875, 0.0),
        (hp.motion.Havsin, lambda s: 0.5 - 0.5 * np.cos(np.pi * s), np.pi / 2, np.pi**2 / 2),
    ],
)
def test_transitions_are_those_of_adams(kind, form, slope: float, bend: float) -> None:
    function = kind(**SPAN)
    s = np.random.default_rng(1).uniform(0.0, 1.0, 300)
    value, rate = function.value_and_rate(0.7 + 1.2 * s)
    np.testing.assert_allclose(value, 0.25 - 0.4 * form(s), atol=1e-15)
    np.testing.assert_allclose(rate, -0.4 / 1.2 * form(s + 1e-30j).imag / 1e-30, atol=1e-14)
    time = np.array([-3.0, 0.7, 1.3, 1.9, 50.0])
    value, rate, acceleration = function.derivatives(time)
    np.testing.assert_allclose(value, [0.25, 0.25, 0.05, -0.15, -0.15], atol=1e-15)
    np.testing.assert_allclose(rate, [0, 0, -slope / 3.0, 0, 0], atol=1e-15)
    first = -0.4 / 1.2**2 * bend
    np.testing.assert_allclose(acceleration, [0, first, 0, 0, 0], atol=1e-14)
    before = function.acceleration(time, inside=time - 1e-3)
    np.testing.assert_allclose(before, [0, 0, 0, -first, 0], atol=1e-14)


@pytest.mark.parametrize("ramp_share", [0.25, 0.5])
def test_the_rate_of_a_velocity_step_is_a_sum_of_adams_steps(ramp_share: float) -> None:
    function = hp.motion.VelocityStep(**SPAN, ramp_share=ramp_share)
    ramp, level = 1.2 * ramp_share, -0.4 / (1.2 * (1.0 - ramp_share))
    rise = hp.motion.Step(start=0.7, end=0.7 + ramp, initial=0.0, final=level)
    fall = hp.motion.Step(start=1.9 - ramp, end=1.9, initial=0.0, final=-level)
    adams = hp.motion.Sum(terms=(rise, fall))
    time = np.sort(np.concatenate([np.linspace(0.5, 2.1, 301), function.kinks_until(3.0)]))
    value, rate, acceleration = function.derivatives(time)
    wanted, bend = adams.value_and_rate(time)
    np.testing.assert_allclose(rate, wanted, atol=1e-14)
    np.testing.assert_allclose(acceleration, bend, atol=1e-12)
    assert value[-1] == pytest.approx(-0.15, abs=1e-15)
    with refused(ParameterError, "VelocityStep.ramp_share", 0.6):
        hp.motion.VelocityStep(**SPAN, ramp_share=0.6)


@every_function
def test_derivatives_are_those_of_the_value(function: MotionFunction) -> None:
    """Central differences of fourth order in h = 5e-4 s: error |f^(5)| h^4 / 30 < 2e-9."""
    time, h = away_from_kinks(function, 3, 1.1e-3), 5e-4
    stencil = [(-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12)]
    rate = sum(w * function.value_and_rate(time + k * h)[0] for k, w in stencil) / h
    bend = sum(w * function.value_and_rate(time + k * h)[1] for k, w in stencil) / h
    _, found_rate, found_bend = function.derivatives(time)
    np.testing.assert_allclose(found_rate, rate, atol=3e-9)
    np.testing.assert_allclose(found_bend, bend, atol=1e-8)


@every_function
def test_value_and_rate_are_continuous_and_one_sided_accelerations_are_limits(
    function: MotionFunction,
) -> None:
    kinks = np.array(function.kinks_until(3.0))
    for sign in (-1.0, 1.0):
        near = kinks + sign * 1e-9
        for a, b in zip(function.value_and_rate(near), function.value_and_rate(kinks), strict=True):
            np.testing.assert_allclose(a, b, atol=1e-7)  # rates move by 1e-9 s times acceleration
        one_sided = function.acceleration(kinks, inside=kinks + sign * 1e-4)
        np.testing.assert_allclose(one_sided, function.acceleration(near), atol=1e-5)


def test_sums_add_and_repetitions_repeat_with_all_kinks() -> None:
    other = hp.motion.Havsin(start=1.0, end=1.9, initial=0.0, final=0.2)
    total = hp.motion.Sum(terms=(hp.motion.Step(**SPAN), other, 2.0))
    time = np.linspace(0.0, 3.0, 61)
    for k, offset in enumerate((2.0, 0.0, 0.0)):
        parts = hp.motion.Step(**SPAN).derivatives(time)[k] + other.derivatives(time)[k]
        np.testing.assert_allclose(total.derivatives(time)[k], offset + parts, atol=1e-15)
    assert total.kinks_until(9.0) == (0.7, 1.0, 1.9)
    assert total.shortest_time == pytest.approx(0.45)
    again, time = EVERY["periodic"], np.random.default_rng(4).uniform(-2.0, 2.0, 200)
    for now, later in zip(again.derivatives(time), again.derivatives(time + 1.8), strict=True):
        np.testing.assert_allclose(now, later, atol=1e-11)
    kinks = [0.15, 0.25, 0.55, 0.75, 0.85, 1.15]
    np.testing.assert_allclose(again.kinks_until(1.2), kinks, atol=1e-12)
    start = again.value_and_rate(np.array([0.25, 0.4, 0.55]))[0]
    np.testing.assert_allclose(start, [-0.2, 0.0, 0.2], atol=1e-15)


def repeated(function: Any, period: float) -> MotionFunction:
    return hp.motion.Periodic(function=function, period=period)


def sine(period: float) -> MotionFunction:
    return hp.motion.Sine(amplitude=1, period=period)


def knots(**given: Any) -> MotionFunction:
    return hp.motion.Hermite(value=(0, 1), **given)


@pytest.mark.parametrize(
    ("make", "name", "value", "allowed"),
    [
        (lambda: hp.motion.Step(start=1, end=1, initial=0, final=1), "Step.end", 1.0, (1,)),
        (lambda: hp.motion.Step(start=0, end=1, initial=0, final=np.inf), "Step.final", np.inf, ()),
        (lambda: hp.motion.Sum(terms=()), "Sum.terms", (), ()),
        (lambda: repeated(UP, 1.0), "Periodic.function.value", 0.2, (-0.2, -0.4)),
        (lambda: repeated(sine(1.0), 0.5), "Periodic.function.rate", ANY, (6.28318531, 12.6)),
        (lambda: repeated(0.3, 1.0), "Periodic.function", 0.3, ()),
        (lambda: repeated(sine(1e-4), 1e-4).kinks_until(2e2), "Periodic.period", 1e-4, (2e2,)),
        (lambda: knots(time=(0, 1), rate=(0,)), "Hermite.time, value, rate", (2, 2, 1), (2,)),
        (lambda: knots(time=(1, 1), rate=(0, 0)), "Hermite.time", (1, 1), ()),
    ],
)
def test_refusals(make, name: str, value: Any, allowed: tuple[float, ...]) -> None:
    with refused(ParameterError, name, value, allowed=allowed):
        make()


def test_toml_round_trip() -> None:
    for function in EVERY.values():
        body = hp.motion.BodyMotion(pitch=function, height=0.01)
        again = hp.motion.BodyMotion(**read_toml(tomli_w.dumps(body.model_dump(mode="json"))))
        assert again == body and type(again.pitch) is type(function)


# Set-points of a sender: inside the joints' ranges, followed at their velocity limits.


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("athena")  # every joint at most 3.14 rad/s


def stepped(robot: hp.Robot, *changes: dict[str, float]) -> Array:
    rows = [robot.posture.copy()]
    for change in changes:
        rows.append(rows[-1].copy())
        for joint, angle in change.items():
            rows[-1][robot.joint_index(joint)] += angle
    return np.array(rows)


def test_a_jump_becomes_a_move_in_which_all_joints_arrive_together(robot: hp.Robot) -> None:
    q = stepped(robot, {"lf_coxa_joint": 0.314, "rm_femur_joint": -0.1})
    plan = hp.motion.SampledTrajectory([0.0, 1.0], q).plan(robot, 3.0)
    assert (plan.kind, plan.held) == ("linear", False)
    np.testing.assert_allclose(plan.time, [0.0, 1.0, 1.1], atol=1e-12)
    np.testing.assert_array_equal(plan.q, [q[0], q[0], q[1]])
    np.testing.assert_array_equal(plan.v, 0.0)
    middle, rate, _ = SetPoints(plan)(1.05)
    np.testing.assert_allclose(middle, 0.5 * (q[0] + q[1]), atol=1e-15)
    assert not rate.any()
    np.testing.assert_array_equal(SetPoints(plan)(2.0)[0], q[1])
    # 0.628 rad take 0.2 s; after 0.05 s the sender wants the joint back where it was
    q = stepped(robot, {"lf_coxa_joint": 0.628}, {"lf_coxa_joint": -0.628})
    plan = hp.motion.SampledTrajectory([0.0, 1.0, 1.05], q).plan(robot, 3.0)
    column = robot.joint_index("lf_coxa_joint")
    np.testing.assert_allclose(plan.time, [0.0, 1.0, 1.05, 1.1], atol=1e-12)
    np.testing.assert_allclose(plan.q[:, column] - q[0, column], [0, 0, 0.157, 0], atol=1e-12)


def test_infinite_limits_jump_and_zero_limits_refuse_to_move(robot: hp.Robot) -> None:
    q = stepped(robot, {"lf_coxa_joint": 0.3})
    fast = dataclasses.replace(robot, velocity_limit=np.full(18, np.inf))
    plan = hp.motion.SampledTrajectory([0.0, 1.0], q).plan(fast, 2.0)
    assert plan.held
    np.testing.assert_array_equal(plan.q, q)
    velocity = robot.velocity_limit.copy()
    velocity[robot.joint_index("lf_coxa_joint")] = 0.0
    stuck = dataclasses.replace(robot, velocity_limit=velocity)
    name = "SampledTrajectory.q[lf_coxa_joint]"
    with refused(ParameterError, name, 0.3, allowed=(0.0,), about=("0 rad/s",)):
        hp.motion.SampledTrajectory([0.0, 1.0], q).plan(stuck, 2.0)
    q = stepped(robot, {"rr_tibia_joint": 9.0})
    with refused(ParameterError, "SampledTrajectory.q[rr_tibia_joint]"):
        hp.motion.SampledTrajectory([0.0, 0.5], q).plan(robot, 1.0)
    plan = hp.motion.SampledTrajectory([0.0, 0.5], q, limited=False).plan(robot, 1.0)
    assert plan.held
