"""S2's motion as functions of time: the printed order and angles, and the steady arc walk."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control import leg_group
from hexapod_pin.control.gait import LEG_ORDER
from hexapod_pin.control.joint_trajectory import trajectory_curve
from hexapod_pin.control.registry import read_controller
from hexapod_pin.errors import GaitError, ParameterError

LEG_NUMBERS = ("lf", "rf", "lm", "rm", "lr", "rr")
"""Names of [S2]'s legs 1..6."""


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


def degrees(
    robot: hp.Robot, motion: hp.motion.JointMotion, joint: str, time: list[float]
) -> np.ndarray:
    """Return a joint's angles from its standing angle, at times [s], by its function [deg]."""
    function = motion.motion[joint]
    assert not isinstance(function, float)
    stands = robot.posture[robot.joint_index(joint)]
    return np.degrees(function.value_and_rate(np.array(time))[0] - stands)


def test_legs_lift_in_the_printed_order(robot: hp.Robot) -> None:
    """Stages of T/3: legs (2, 3), then (1, 6), then (4, 5) are up by 6 degrees in the middle."""
    motion = hp.motion.paper_motion(robot)
    middles = [0.4, 1.2, 2.0, 2.8]
    for number, leg in enumerate(LEG_NUMBERS, start=1):
        stage = next(k for k, pair in enumerate(((2, 3), (1, 6), (4, 5))) if number in pair)
        wanted = [6.0 if k % 3 == stage else 0.0 for k in range(4)]
        found = degrees(robot, motion, f"{leg}_femur_joint", middles)
        # a femur rises about its own axis: the sign is the side's
        np.testing.assert_allclose(np.abs(found), wanted, atol=1e-9)
        edges = degrees(robot, motion, f"{leg}_femur_joint", [0.0, 0.8, 1.6, 2.4])
        np.testing.assert_allclose(edges, 0.0, atol=1e-9)


def test_feet_go_back_in_stance_and_forward_in_swing(robot: hp.Robot) -> None:
    """By forward kinematics: x of each foot is largest at its placement, R sin 20 deg ahead."""
    gait, six = hp.Gait.tetrapod(), leg_group(robot)
    plan = hp.motion.paper_motion(robot).plan(robot, 8.0)
    curve = trajectory_curve(plan)
    for leg, phase in enumerate(gait.phases):
        placed = (1.0 + phase) * gait.cycle_time
        rows = curve(np.array([placed, placed + 1.6, placed + 2.0, placed + 2.4]))
        q = np.stack([six.leg_rows(row) for row in rows], axis=1)
        feet = six.kinematics.chain.forward(q)[leg] - six.neutral_feet[leg]
        reach = 0.20284 * np.sin(np.radians(20.0))
        np.testing.assert_allclose(feet[[0, 1, 3], 0], [reach, -reach, reach], atol=1e-5)
        assert feet[2, 2] == pytest.approx(0.0130, abs=5e-5)  # mid-swing, up
        np.testing.assert_allclose(feet[[0, 1, 3], 2], 0.0, atol=1e-9)


@pytest.mark.parametrize("profile", ["step", "constant", "velocity-step"])
@pytest.mark.parametrize(
    "gait",
    [hp.Gait.tetrapod(), hp.Gait.tripod(cycle_time=1.7), hp.Gait.wave(cycle_time=3.1)],
    ids=lambda gait: gait.name,
)
def test_it_is_the_steady_arc_walk(robot: hp.Robot, gait: hp.Gait, profile: str) -> None:
    """`ArcPath.joints` is computed from the body's motion, at any time, without functions."""
    walk = hp.motion.ArcWalk(gait, amplitude=0.3, lift_angle=0.08, profile=profile)
    path, six = walk.path(robot), leg_group(robot)
    motion = hp.motion.paper_motion(robot, gait, amplitude=0.3, lift_angle=0.08, profile=profile)
    cycles = np.random.default_rng(2).uniform(2.0, 5.0, 3000)
    time = np.sort(cycles) * gait.cycle_time
    q, v = path.joints(time)
    plan = motion.plan(robot, float(time[-1]))
    curve = trajectory_curve(plan)
    np.testing.assert_allclose(curve(time), six.joint_rows(q, six.posture), rtol=0, atol=1e-12)
    np.testing.assert_allclose(curve(time, 1), six.joint_rows(v, 0.0), rtol=0, atol=1e-11)
    assert plan.speed == pytest.approx(path.speed, rel=1e-14)
    assert (plan.cycle_time, plan.steady_from) == (gait.cycle_time, gait.cycle_time)


def test_velocities_are_steps_to_a_plateau_and_back(robot: hp.Robot) -> None:
    """[S2]'s figure 3: in stance -2 A / (1.6 s) / 0.9 between ramps of 0.16 s, 0 at both ends.

    In swing the coxa's plateau is twice that, of the other sign; the femur has one up, one down.
    """
    motion = hp.motion.paper_motion(robot, stroke=0.14)
    turn, lift = (motion.motion[f"lr_{part}_joint"] for part in ("coxa", "femur"))
    assert isinstance(turn, hp.motion.Periodic) and isinstance(lift, hp.motion.Periodic)
    level = 2.0 * np.arcsin(0.07 / 0.20284) / 1.6 / 0.9
    time = np.array([0.0, 0.08, 0.16, 0.8, 1.44, 1.52, 1.6, 1.68, 2.0, 2.32, 2.4])
    shares = np.array([0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0, -2.0, -2.0, -2.0, 0.0])
    found = turn.value_and_rate(time)[1]  # leg 5 is placed at t = 0
    np.testing.assert_allclose(np.sign(found[3]) * found, level * shares, atol=2e-5)
    peak = np.radians(6.0) / 0.4 / 0.9
    up_and_down = lift.value_and_rate(np.array([1.0, 1.64, 1.8, 1.96, 2.0, 2.04, 2.2, 2.36]))[1]
    shares = np.array([0.0, 1.0, 1.0, 1.0, 0.0, -1.0, -1.0, -1.0])
    np.testing.assert_allclose(np.sign(up_and_down[1]) * up_and_down, peak * shares, atol=1e-12)


def test_there_is_no_ramp(robot: hp.Robot) -> None:
    """The first cycle is the second one; legs stand where the phase of the gait puts them.

    At t = 0 legs 2 and 3 lift off, 4 and 5 were just placed, 1 and 6 are in mid-stance.
    """
    plan, six = hp.motion.paper_motion(robot).plan(robot, 4.8), leg_group(robot)
    curve, time = trajectory_curve(plan), np.linspace(0.0, 2.4, 401)
    np.testing.assert_allclose(curve(time), curve(time + 2.4), atol=1e-12)
    feet = six.kinematics.chain.forward(six.leg_rows(plan.q[0])[:, None])[:, 0]
    ahead = (feet - six.neutral_feet)[:, 0] / (0.20284 * np.sin(np.radians(20.0)))
    shares = {"lf": 0, "rf": -1, "lm": -1, "rm": 1, "lr": 1, "rr": 0}
    np.testing.assert_allclose(ahead, [shares[leg] for leg in LEG_ORDER], atol=1e-4)


def test_stroke_sets_the_amplitude(robot: hp.Robot) -> None:
    """Asin(stroke / 2 R): 0.14 m takes 20.19 degrees."""
    motion = hp.motion.paper_motion(robot, stroke=0.14)
    angle = np.abs(degrees(robot, motion, "lr_coxa_joint", [0.0]))
    assert angle == pytest.approx(np.degrees(np.arcsin(0.07 / 0.20284)), abs=1e-3)
    assert angle == pytest.approx(20.19, abs=0.005)
    assert motion.speed == pytest.approx(0.0875, rel=1e-12)  # stroke / (2/3 * 2.4 s)


def test_refusals(robot: hp.Robot) -> None:
    with refused(ParameterError, "paper_motion.amplitude", 0.3):
        hp.motion.paper_motion(robot, stroke=0.1, amplitude=0.3)
    with refused(ParameterError, "paper_motion.stroke", float("nan")):
        hp.motion.paper_motion(robot, stroke=float("nan"))
    for stroke in (0.0, 0.41):
        with refused(ParameterError, "paper_motion.stroke", stroke, allowed=(0, 0.4057)):
            hp.motion.paper_motion(robot, stroke=stroke)
    with refused(ParameterError, "paper_motion.profile", "smooth"):
        hp.motion.paper_motion(robot, profile="smooth")  # type: ignore[arg-type]
    for share in (0.0, 0.51):
        with refused(ParameterError, "ArcWalk.ramp_share", share, allowed=(0, 0.5)):
            hp.motion.paper_motion(robot, ramp_share=share)
    with refused(GaitError, quantity="cycle_time"):
        hp.motion.paper_motion(robot, hp.Gait.tetrapod(cycle_time=0.3))


def test_it_is_data(robot: hp.Robot) -> None:
    for profile in ("step", "constant", "velocity-step"):
        motion = hp.motion.paper_motion(robot, profile=profile)
        assert read_controller(motion.to_dict()) == motion
        assert len(motion.motion) == 12  # tibiae stand
