"""Walking on arcs as S2 does, also as functions of time: closed forms, signs, refusals, a run."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control import leg_group
from hexapod_pin.control.joint_trajectory import trajectory_curve
from hexapod_pin.errors import GaitError, ParameterError

ROBOT = hp.load_robot("kharagpur")
R = 0.20284
"""[S2] table 2: coxa and femur, m."""
DENSE = np.linspace(4.8, 7.2, 2401)
"""The third cycle, steady [s]."""


def test_stance_feet_move_on_arcs_about_their_hips() -> None:
    """S2's 20 degrees, measured on the path: stroke 138.75, scrub 12.2, lift 13.0 mm."""
    path = hp.motion.ArcWalk(profile="step").path(ROBOT)
    assert path.speed == pytest.approx(0.13875 / 1.6, rel=1e-4)
    feet, down = path.positions(DENSE), path.stance(DENSE)
    stroke, scrub = 2 * R * np.sin(np.radians(20.0)), R * (1 - np.cos(np.radians(20.0)))
    assert (path.gait.stroke, path.scrub) == pytest.approx((stroke, scrub), abs=1e-6)
    for k, leg in enumerate(leg_group(ROBOT).legs):
        held = feet[down[:, k], k]
        assert np.hypot(*(held - leg.origins[0])[:, :2].T) == pytest.approx(R, abs=1e-9)
        assert np.ptp(held[:, :2], axis=0) == pytest.approx([stroke, scrub], abs=1e-5)
        assert np.ptp(held[:, 2]) < 1e-12
        assert feet[~down[:, k], k, 2].max() - held[0, 2] == pytest.approx(0.0130, abs=5e-5)


@pytest.mark.parametrize("robot", ["kharagpur", "athena"])
def test_all_stance_feet_go_backwards_and_all_femora_lift(robot: str) -> None:
    """A wrong sign on either side fails: joint axes of left and right differ."""
    loaded = hp.load_robot(robot)
    path = hp.motion.ArcWalk(amplitude=0.3).path(loaded)
    p, v, down = path.positions(DENSE), path.velocities(DENSE), path.stance(DENSE)
    assert (v[down][:, 0] < 0.0).all()
    assert v[down][:, 0].mean() == pytest.approx(-path.speed, rel=1e-3)
    sole = leg_group(loaded).neutral_feet[:, 2]
    assert (np.where(down, 0.0, p[..., 2] - sole).min() > -1e-12).all()
    assert ((p[..., 2] - sole).max(axis=0) > 0.01).all()


@pytest.mark.parametrize(
    ("profile", "gait"),
    [
        ("constant", hp.Gait.tetrapod()),
        ("step", hp.Gait.tripod()),
        ("velocity-step", hp.Gait.wave(0.8)),
    ],
)
def test_motion_is_smooth_from_rest_to_rest(profile: str, gait: hp.Gait) -> None:
    """Rates are the derivative of angles and do not jump; start and end stand in the posture."""
    walk = hp.motion.ArcWalk(gait, amplitude=0.2, profile=profile, stop_at=12.0)
    path, h = walk.path(ROBOT), 1e-5
    time = np.linspace(2 * h, 11.99, 5001)
    (before, _), (after, _), (_, v) = (path.joints(time + k * h) for k in (-1, 1, 0))
    assert np.abs((after - before) / (2 * h) - v).max() < 2e-4  # 4e1 rad/s^2 jumps times h/2
    plan = walk.plan(ROBOT, 20.0)
    for row in (0, -1):
        assert plan.q[row] == pytest.approx(ROBOT.posture, abs=1e-12)
        assert plan.v[row] == pytest.approx(0.0, abs=1e-12)
    assert plan.time[-1] == 12.0
    assert path.body.twist(np.array([5.0, 12.5]))[:, 0] == pytest.approx([path.speed, 0.0])


def test_a_run_goes_ahead_at_its_speed_and_scrubs() -> None:
    """Within 1 %; every foot slides twice the scrub or more, in all 221 mm a cycle; IK 5 mm."""
    walk = hp.motion.ArcWalk()
    gait = hp.Gait.tetrapod(stroke=walk.path(ROBOT).gait.stroke)
    arcs, straight = (
        hp.simulate(hp.Scene(ROBOT), control, duration=7.2, accuracy=1e-3)
        for control in (walk, hp.KinematicControl(gait))
    )
    travelled = arcs.q[-1, :2] - arcs.q[np.searchsorted(arcs.time, 4.8 - 1e-9), :2]
    assert travelled[0] / 2.4 == pytest.approx(walk.path(ROBOT).speed, rel=0.01)
    assert abs(travelled[1]) < 0.05 * travelled[0]
    assert (arcs.summary.slip_distance > 2.0 * walk.path(ROBOT).scrub).all()
    assert straight.summary.slip_distance.sum() < 0.05 * arcs.summary.slip_distance.sum()


def test_what_the_robot_cannot_do_is_refused_with_what_it_can() -> None:
    """Rates, ranges, and legs in each other's way; the limit works, a little more does not."""
    with refused(GaitError, quantity="cycle_time") as fast:
        hp.motion.ArcWalk(hp.Gait.tetrapod(cycle_time=0.2)).plan(ROBOT, 1.0)
    hp.motion.ArcWalk(hp.Gait.tetrapod(cycle_time=fast.value.limit * 1.001)).plan(ROBOT, 1.0)
    with refused(GaitError, quantity="amplitude") as wide:
        hp.motion.ArcWalk(amplitude=1.2).plan(ROBOT, 1.0)
    hp.motion.ArcWalk(amplitude=wide.value.limit).plan(ROBOT, 1.0)
    with refused(GaitError, quantity="amplitude", about=("overlap",)):
        hp.motion.ArcWalk().plan(hp.load_robot("athena"), 1.0)
    with refused(GaitError, quantity="lift_angle"):
        hp.motion.ArcWalk(lift_angle=1.5).plan(ROBOT, 1.0)


def test_wrong_settings_are_refused() -> None:
    for name, value in (("amplitude", 0.0), ("lift_angle", 2.0), ("ramp_share", 0.51)):
        with refused(ParameterError, f"ArcWalk.{name}", value):
            hp.motion.ArcWalk(**{name: value})
    with refused(ParameterError, "ArcWalk.gait.heading", 0.1, allowed=(0.0,)):
        hp.motion.ArcWalk(hp.Gait.tetrapod(heading=0.1))
    with refused(ParameterError, "stop_at", 2.0, allowed=(7.6,)):
        hp.motion.ArcWalk(stop_at=2.0).plan(ROBOT, 1.0)
    with refused(ParameterError, "paper_motion.amplitude", 0.3):
        hp.motion.paper_motion(ROBOT, stroke=0.1, amplitude=0.3)
    with refused(ParameterError, "paper_motion.stroke", 0.41, allowed=(0, 0.4057)):
        hp.motion.paper_motion(ROBOT, stroke=0.41)


def test_legs_lift_in_the_printed_order() -> None:
    """Stages of T/3: legs (2, 3), then (1, 6), then (4, 5) are up by 6 degrees in the middle."""
    motion, time = hp.motion.paper_motion(ROBOT).motion, 0.4 * np.arange(8.0)
    for number, leg in enumerate(("lf", "rf", "lm", "rm", "lr", "rr"), start=1):
        stage = next(k for k, pair in enumerate(((2, 3), (1, 6), (4, 5))) if number in pair)
        wanted = [6.0 if k % 2 and (k // 2) % 3 == stage else 0.0 for k in range(8)]
        function, joint = motion[f"{leg}_femur_joint"], ROBOT.joint_index(f"{leg}_femur_joint")
        assert isinstance(function, hp.motion.Periodic)
        found = np.degrees(function.value_and_rate(time)[0] - ROBOT.posture[joint])
        # a femur rises about its own axis: the sign is the side's
        np.testing.assert_allclose(np.abs(found), wanted, atol=1e-9)


@pytest.mark.parametrize(
    ("gait", "profile"),
    [
        (hp.Gait.tetrapod(), "step"),
        (hp.Gait.tripod(cycle_time=1.7), "constant"),
        (hp.Gait.wave(cycle_time=3.1), "velocity-step"),
    ],
)
def test_it_is_the_steady_arc_walk(gait: hp.Gait, profile: str) -> None:
    """`ArcPath.joints` is computed from the body's motion, at any time, without functions."""
    walk = hp.motion.ArcWalk(gait, amplitude=0.3, lift_angle=0.08, profile=profile)
    path, six = walk.path(ROBOT), leg_group(ROBOT)
    motion = hp.motion.paper_motion(ROBOT, gait, amplitude=0.3, lift_angle=0.08, profile=profile)
    cycles = np.random.default_rng(2).uniform(2.0, 5.0, 3000)
    time = np.sort(cycles) * gait.cycle_time
    q, v = path.joints(time)
    plan = motion.plan(ROBOT, float(time[-1]))
    curve = trajectory_curve(plan)
    np.testing.assert_allclose(curve(time), six.joint_rows(q, six.posture), rtol=0, atol=1e-12)
    np.testing.assert_allclose(curve(time, 1), six.joint_rows(v, 0.0), rtol=0, atol=1e-11)
    assert plan.speed == pytest.approx(path.speed, rel=1e-14)
    assert (plan.cycle_time, plan.steady_from) == (gait.cycle_time, gait.cycle_time)


def test_velocities_are_steps_to_a_plateau_and_back() -> None:
    """[S2]'s figure 3: in stance -2 A / (1.6 s) / 0.9 between ramps of 0.16 s, 0 at both ends.

    In swing the coxa's plateau is twice that, of the other sign; the femur has one up, one down.
    """
    motion = hp.motion.paper_motion(ROBOT, stroke=0.14)
    turn, lift = (motion.motion[f"lr_{part}_joint"] for part in ("coxa", "femur"))
    assert isinstance(turn, hp.motion.Periodic) and isinstance(lift, hp.motion.Periodic)
    assert motion.speed == pytest.approx(0.0875, rel=1e-12)  # stroke / (2/3 * 2.4 s)
    level = 2.0 * np.arcsin(0.07 / 0.20284) / 1.6 / 0.9
    time = np.array([0.0, 0.08, 0.16, 0.8, 1.44, 1.52, 1.6, 1.68, 2.0, 2.32, 2.4])
    shares = np.array([0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0, -2.0, -2.0, -2.0, 0.0])
    found = turn.value_and_rate(time)[1]  # leg 5 is placed at t = 0
    np.testing.assert_allclose(np.sign(found[3]) * found, level * shares, atol=2e-5)
    peak = np.radians(6.0) / 0.4 / 0.9
    up_and_down = lift.value_and_rate(np.array([1.0, 1.64, 1.8, 1.96, 2.0, 2.04, 2.2, 2.36]))[1]
    shares = np.array([0.0, 1.0, 1.0, 1.0, 0.0, -1.0, -1.0, -1.0])
    np.testing.assert_allclose(np.sign(up_and_down[1]) * up_and_down, peak * shares, atol=1e-12)
