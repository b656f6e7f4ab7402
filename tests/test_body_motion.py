"""Trunk motion and velocity commands: functions as data, exact rates, poses that are reached."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from refusals import NUMBER, refused

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.commanded_body import MAX_ACCELERATION
from hexapod_pin.errors import GaitError, ParameterError

GAIT = hp.Gait.tetrapod(stroke=0.06, cycle_time=1.6, heading=0.3)
FUNCTIONS = {
    "sine": hp.motion.Sine(amplitude=0.02, period=1.3, phase=0.4, mean=0.01),
    "waypoints": hp.motion.Waypoints(time=(0.5, 1.0, 2.5), value=(0.0, 0.03, -0.01)),
}


def stiff_scene() -> hp.Scene:
    robot = hp.load_robot("kharagpur")
    servo = hp.Servo.from_effort(robot, error=0.003).model_copy(update={"limited": False})
    return hp.Scene(robot, servo=servo)


def roll_pitch_yaw(q: Array) -> Array:
    return np.asarray(pin.rpy.matrixToRpy(pin.Quaternion(*q[[6, 3, 4, 5]]).toRotationMatrix()))


def test_two_waypoints_are_joined_by_the_curve_of_least_jerk() -> None:
    s = np.linspace(0.0, 1.0, 50)
    rise = hp.motion.Waypoints(time=(1.0, 3.0), value=(0.02, 0.05))
    curve, _ = rise.value_and_rate(1.0 + 2.0 * s)
    np.testing.assert_allclose(curve, 0.02 + 0.03 * s**3 * (10 - 15 * s + 6 * s**2), atol=1e-15)
    points, time, h = FUNCTIONS["waypoints"], np.linspace(0.0, 3.0, 301), 1e-6
    for function in FUNCTIONS.values():
        later, before = (function.value_and_rate(time + k)[0] for k in (h, -h))
        rate = function.value_and_rate(time)[1]
        np.testing.assert_allclose(rate, (later - before) / (2 * h), atol=1e-9)
    assert isinstance(points, hp.motion.Waypoints)
    value, rate = points.value_and_rate(np.array([0.0, 0.5, 1.0, 2.5, 9.0]))
    np.testing.assert_allclose(value, [0.0, 0.0, 0.03, -0.01, -0.01], atol=1e-15)
    np.testing.assert_allclose(rate[[0, 1, 3, 4]], 0.0, atol=1e-14)


def test_malformed_functions_are_refused() -> None:
    sine, points, command = hp.motion.Sine, hp.motion.Waypoints, hp.motion.VelocityCommand
    for make, name, value in (
        (lambda: sine(amplitude=1.0, period=0.0), "Sine.period", 0.0),
        (lambda: points(time=(0.0,), value=(1.0,)), "Waypoints.time, value", (1, 1)),
        (lambda: points(time=(0.0, 0.0), value=(1.0, 2.0)), "Waypoints.time", (0.0, 0.0)),
        (lambda: hp.motion.BodyMotion(height=np.nan), "BodyMotion.height", np.nan),
        (lambda: command(time=()), "VelocityCommand.time", ()),
        (lambda: command(time=(0.0, 1.0), forward=(0.1,)), "VelocityCommand.forward", (0.1,)),
    ):
        with refused(ParameterError, name, value):
            make()


def test_trunk_offset_is_a_rotation_with_its_angular_velocity() -> None:
    motion = hp.motion.BodyMotion(
        roll=FUNCTIONS["sine"],
        pitch=FUNCTIONS["waypoints"],
        yaw=hp.motion.Sine(amplitude=0.4, period=2.0),
    )
    h, time = 1e-6, np.linspace(0.1, 2.9, 30)
    here, later, before = (motion.offset(time + k) for k in (0.0, h, -h))
    for k in range(len(time)):
        spin = here.rotation[k].T @ (later.rotation[k] - before.rotation[k]) / (2 * h)
        found = [spin[2, 1], spin[0, 2], spin[1, 0]]
        np.testing.assert_allclose(here.angular_velocity[k], found, atol=1e-8)
    tilted = hp.motion.BodyMotion(roll=0.2, pitch=-0.3, yaw=0.5)
    expected = pin.rpy.rpyToMatrix(0.2, -0.3, 0.5)
    np.testing.assert_allclose(tilted.offset(np.array(0.0)).rotation, expected, atol=1e-15)
    start = tilted.start_pose()
    np.testing.assert_allclose(roll_pitch_yaw(start), [0.2, -0.3, 0.5], atol=1e-15)


def test_a_walking_trunk_follows_its_motion() -> None:
    motion = hp.motion.BodyMotion(
        height=hp.motion.Sine(amplitude=0.01, period=1.0),
        pitch=hp.motion.Sine(amplitude=0.05, period=2.0),
        roll=0.03,
        forward=0.01,
        yaw=0.1,
        lateral=hp.motion.Waypoints(time=(1.0, 2.0), value=(0.0, 0.02)),
    )
    gait = GAIT.with_changes(heading=0.0)
    control, robot = hp.KinematicControl(gait, body=motion), hp.load_robot("kharagpur")
    trace = hp.simulate(stiff_scene(), control, duration=3.0)
    assert np.abs(trace.foot_gap[0]).max() < 1e-12  # six feet touch
    offset, height = motion.offset(trace.time).position, robot.stand().q[2]
    np.testing.assert_allclose(trace.q[0, :3] - [0.0, 0.0, height], offset[0], atol=1e-12)
    np.testing.assert_allclose(trace.q[:, 2] - height, offset[:, 2], atol=7e-4)
    np.testing.assert_allclose(trace.q[:, 1], offset[:, 1], atol=5e-4)
    turn = np.array([roll_pitch_yaw(q) for q in trace.q[::25]])
    pitch = 0.05 * np.sin(np.pi * trace.time[::25])
    wanted = np.stack([0.0 * pitch + 0.03, pitch, 0.0 * pitch + 0.1], axis=1)
    np.testing.assert_allclose(turn, wanted, atol=1.5e-3)
    short = control.plan(robot, 5e-324)  # its length was divided by
    assert len(short.time) > 1 and (short.q[0] == control.plan(robot, 2.0).q[0]).all()


def test_a_motion_or_command_beyond_reach_is_refused_with_its_time() -> None:
    robot = hp.load_robot("kharagpur")
    with refused(GaitError, quantity="height", about=("BodyMotion(height=0.3)", "leg lf")) as far:
        hp.KinematicControl(GAIT, body=hp.motion.BodyMotion(height=0.3)).plan(robot, 5.0)
    highest = hp.motion.BodyMotion(height=far.value.limit)
    hp.KinematicControl(GAIT, body=highest).plan(robot, 5.0)
    rising = hp.motion.BodyMotion(height=hp.motion.Waypoints(time=(2.0, 4.0), value=(0.0, 0.25)))
    with refused(GaitError, quantity="body", about=("lf_femur_joint",)) as far:
        hp.KinematicControl(GAIT, body=rising).plan(robot, 5.0)
    assert 2.0 <= float(NUMBER.findall(str(far.value))[0]) < 4.0  # the time comes first
    hp.KinematicControl(GAIT, body=rising).plan(robot, 2.0)
    shaking = hp.motion.BodyMotion(height=hp.motion.Sine(amplitude=0.02, period=0.05))
    with refused(GaitError, quantity="cycle_time", about=("tibia_joint", "6")) as fast:
        hp.KinematicControl(GAIT, body=shaking).plan(robot, 2.0)
    assert 0.0 <= float(NUMBER.findall(str(fast.value))[0]) <= 2.0
    with refused(ParameterError, "stop_at", 20.0):
        hp.KinematicControl(GAIT, velocity=STEPS, stop_at=20.0)
    fast = hp.motion.VelocityCommand(time=(0.0, 1.25), forward=(0.05, 0.5))
    about = ("VelocityCommand", "1.25", "0.5")
    with refused(GaitError, quantity="speed", about=about) as caught:
        hp.KinematicControl(GAIT, velocity=fast).plan(robot, 2.5)
    limit = caught.value.limit
    assert limit is not None and 0.05 < limit < 0.5
    slower = hp.motion.VelocityCommand(time=(0.0, 1.25), forward=(0.05, 0.98 * limit))
    hp.KinematicControl(GAIT, velocity=slower).plan(robot, 5.0)
    hp.KinematicControl(GAIT, velocity=fast).plan(robot, 0.5)  # ends before


STEPS = hp.motion.VelocityCommand(
    time=(0.0, 4.0, 5.0, 8.0), forward=(0.05, 0.03, -0.02, 0.0), lateral=(0.0, 0.02, 0.0, 0.0),
    turn_rate=(0.0, 0.1, -0.1, 0.0),
)  # fmt: skip


def test_a_constant_command_is_the_gait_itself() -> None:
    """Another path through the code: ramp by steps, pose by quadrature, footholds foreseen."""
    robot = hp.load_robot("athena")
    gait = GAIT.with_changes(turn_rate=0.1)
    along = gait.speed * np.array([np.cos(0.3), np.sin(0.3)])
    command = hp.motion.VelocityCommand(
        time=(0.0,), forward=along[0], lateral=along[1], turn_rate=0.1
    )
    paths = [hp.KinematicControl(gait, **k).path(robot) for k in ({}, {"velocity": command})]
    first, second = (path.positions(np.linspace(0.0, 8.0, 500)) for path in paths)
    np.testing.assert_allclose(first, second, atol=1e-12)


def test_a_foothold_does_not_know_the_future() -> None:
    """Commands after a foot's lift-off change nothing until it lifts; the trunk is not jerked."""
    robot = hp.load_robot("kharagpur")
    other = STEPS.model_copy(update={"forward": (0.05, -0.03, 0.04, 0.02)})
    paths = [hp.KinematicControl(GAIT, velocity=one).path(robot) for one in (STEPS, other)]
    placement = np.tile(np.arange(-1.0, 9.0)[:, None], (1, 6))
    first, second = (path.footholds.at(placement) for path in paths)
    lifted = (placement + np.array(GAIT.phases) - (1.0 - GAIT.duty)) * GAIT.cycle_time
    np.testing.assert_array_equal(first[lifted < 4.0 - 1e-9], second[lifted < 4.0 - 1e-9])
    changed = np.abs(first - second).max(axis=-1)[(lifted > 4.0) & (lifted < 8.0)]
    assert changed.min() > 1e-4
    time, h, body = np.linspace(0.0, 12.0, 2401), 1e-4, paths[0].body
    before, twist, after = (body.pose_and_twist(time + k * h)[1] for k in (-1, 0, 1))
    slope, bend = (after - before) / (2 * h), (after - 2 * twist + before) / h**2
    assert np.hypot(slope[:, 0], slope[:, 1]).max() <= MAX_ACCELERATION
    assert np.abs(np.diff(bend, axis=0)).max() < 0.02  # continuous: 5 ms of a bounded third
    moved = (body.pose(time + h) - body.pose(time - h)) / (2 * h)
    c, s = (turn(body.pose(time)[:, 2]) for turn in (np.cos, np.sin))
    moved[:, :2] = np.stack(
        [c * moved[:, 0] + s * moved[:, 1], c * moved[:, 1] - s * moved[:, 0]], 1
    )
    np.testing.assert_allclose(moved, twist, atol=1e-8)


def test_a_walk_on_command_follows_it_and_ends_standing() -> None:
    scene = stiff_scene()
    control = hp.KinematicControl(GAIT, velocity=STEPS)
    plan = control.plan(scene.robot, 16.0)
    np.testing.assert_allclose(plan.q[-1], scene.robot.posture, atol=1e-12)
    assert plan.cycle_time is None
    trace = hp.simulate(scene, control, duration=13.0)
    x, y, yaw = control.path(scene.robot).body_pose(np.array([13.0]))[0]
    np.testing.assert_allclose(trace.q[-1, :2], [x, y], atol=0.01 * 0.3)  # 1 % of the path
    assert roll_pitch_yaw(trace.q[-1])[2] == pytest.approx(yaw, abs=0.004)
