"""Set-points of a sender: inside the joints' ranges, followed at their velocity limits."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.sampled_trajectory import coordinated_moves
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.set_points import SetPoints


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("athena")  # every joint at most 3.14 rad/s


def stepped(robot: hp.Robot, *changes: dict[str, float]) -> Array:
    """Return rows of set-points: the posture, then with each of the changes on top."""
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


def test_an_unfinished_move_goes_on_from_where_it_is(robot: hp.Robot) -> None:
    """0.628 rad take 0.2 s; after 0.05 s the sender wants the joint back where it was."""
    q = stepped(robot, {"lf_coxa_joint": 0.628}, {"lf_coxa_joint": -0.628})
    plan = hp.motion.SampledTrajectory([0.0, 1.0, 1.05], q).plan(robot, 3.0)
    column = robot.joint_index("lf_coxa_joint")
    np.testing.assert_allclose(plan.time, [0.0, 1.0, 1.05, 1.1], atol=1e-12)
    np.testing.assert_allclose(plan.q[:, column] - q[0, column], [0, 0, 0.157, 0], atol=1e-12)


def test_no_joint_is_ever_faster_than_its_limit(robot: hp.Robot) -> None:
    random = np.random.default_rng(3)
    time = np.cumsum(random.uniform(0.01, 0.2, 60))
    time -= time[0]
    q = robot.posture + random.uniform(-0.2, 0.2, (60, len(robot.posture)))
    at, angles = coordinated_moves(time, q, robot.velocity_limit)
    rate = np.abs(np.diff(angles, axis=0)) / np.diff(at)[:, None]
    assert (rate / robot.velocity_limit).max() == pytest.approx(1.0, abs=1e-9)
    fastest = (rate / robot.velocity_limit).max(axis=1)
    np.testing.assert_allclose(fastest[fastest > 1e-9], 1.0, atol=1e-9)  # all moves, no dawdling
    begins = np.isclose(at[:, None], time).any(axis=0)
    assert begins.all()
    np.testing.assert_allclose(angles[-1], q[-1])


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
    still = hp.motion.SampledTrajectory([0.0, 1.0], q[[0, 0]]).plan(stuck, 2.0)
    np.testing.assert_array_equal(still.q[0], q[0])


def test_a_set_point_outside_its_range_is_refused(robot: hp.Robot) -> None:
    q = stepped(robot, {"rr_tibia_joint": 9.0})
    row = robot.joint_index("rr_tibia_joint")
    name = "SampledTrajectory.q[rr_tibia_joint]"
    limits = tuple(float(f"{limit[row]:.4f}") for limit in (robot.lower, robot.upper))
    with refused(ParameterError, name, q[1, row], allowed=limits):
        hp.motion.SampledTrajectory([0.0, 0.5], q).plan(robot, 1.0)
    plan = hp.motion.SampledTrajectory([0.0, 0.5], q, limited=False).plan(robot, 1.0)
    assert plan.held
    np.testing.assert_array_equal(plan.q, q)


def test_settings_are_data(robot: hp.Robot) -> None:
    own = hp.motion.SampledTrajectory([0.0], robot.posture[None], limited=False)
    settings = own.to_dict()
    assert settings.pop("kind") == "held"
    assert hp.motion.SampledTrajectory(**settings) == own
