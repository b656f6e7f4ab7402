"""Runs whose joints follow a motion: restart, batch, beside servos, drives, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.arrays import Array


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


def walk() -> hp.KinematicControl:
    return hp.KinematicControl(hp.Gait.tetrapod(cycle_time=1.2))


def test_run_goes_on_from_its_checkpoint(robot: hp.Robot) -> None:
    scene = hp.Scene(robot, prescribed=True)
    for settings in ({"accuracy": 1e-5}, {"method": "robust", "step": 5e-4}):
        whole = hp.simulate(scene, walk(), duration=0.4, sample=0.01, **settings)
        first = hp.simulate(scene, walk(), duration=0.2, sample=0.01, **settings)
        rest = hp.simulate(
            scene, walk(), duration=0.2, sample=0.01, initial=first.checkpoint, **settings
        )
        assert np.array_equal(rest.q, whole.q[20:])


def test_batch_and_case_text_give_the_same_bits(robot: hp.Robot) -> None:
    scene = hp.Scene(robot, prescribed=True)
    case = hp.Case(scene, walk(), duration=0.3, accuracy=1e-5)
    again = hp.Case.from_toml(case.to_toml())
    assert again == case
    assert case != hp.Case(hp.Scene(robot), walk(), duration=0.3, accuracy=1e-5)
    first, second = hp.simulate_batch([case, again], threads=2)
    assert np.array_equal(first.q, second.q)
    assert np.array_equal(first.q, case.run().q)


def test_servos_that_stiffen_come_to_it(robot: hp.Robot) -> None:
    """RMS torque of each kind of joint within 2 %, the difference falling with the stiffness."""
    contact, kp = hp.Contact.preset("s1"), 240.0  # N m/rad, the default gain of kharagpur
    paper = hp.motion.ArcWalk(hp.Gait.tetrapod(cycle_time=1.2), profile="step")

    def rms(**settings: Any) -> Array:
        scene = hp.Scene(robot, contact=contact, **settings)
        trace = hp.simulate(scene, paper, duration=3.6, accuracy=1e-4)
        return np.array([kind.rms.torque_rms for kind in hp.torque_budget(trace).kinds])

    def servo(factor: float) -> hp.Servo:
        return hp.Servo(kp=factor * kp, kd=0.02 * factor * kp, limited=False)

    exact = rms(prescribed=True)
    off = [np.abs(rms(servo=servo(factor)) / exact - 1.0).max() for factor in (1.0, 4.0, 64.0)]
    assert off[2] < 0.02
    assert off[2] < off[1] < off[0]


def test_servos_receive_the_same_motion(robot: hp.Robot) -> None:
    """Quintics between knots carry a sine to 1e-11 of its amplitude, into the core too."""
    motion = {"rm_coxa_joint": hp.motion.Sine(amplitude=0.1, period=0.5)}
    trace = hp.simulate(hp.Scene(robot), hp.motion.JointMotion(motion), duration=0.6, sample=0.01)
    value, rate = motion["rm_coxa_joint"].value_and_rate(trace.time)
    joint = robot.joint_index("rm_coxa_joint")
    assert np.abs(trace.q_ref[:, joint] - value).max() < 2e-12
    assert np.abs(trace.v_ref[:, joint] - rate).max() < 1e-9


def test_motor_turns_its_rotor_and_its_friction(robot: hp.Robot) -> None:
    """Torque of a joint in the air: what a rotor and friction add, in closed form."""
    motion = hp.motion.JointMotion(
        {"lf_femur_joint": hp.motion.Sum(terms=(-0.6, hp.motion.Sine(amplitude=0.1, period=0.5)))}
    )
    motor = hp.Motor(
        stall_torque=5.0, no_load_speed=6.0, dry_friction=0.1, viscous_friction=0.02,
        rotor_inertia=1e-7, gear_ratio=200.0,
    )  # fmt: skip
    with_motor = hp.Servo(kp=100.0, kd=2.0, motor={"lf_femur_joint": motor})
    runs = [
        hp.simulate(
            hp.Scene(robot, servo=servo, prescribed=True), motion, duration=0.5, accuracy=1e-7
        )
        for servo in (hp.Servo(kp=100.0, kd=2.0), with_motor)
    ]
    k, t, rate = robot.joint_index("lf_femur_joint"), runs[0].time, 2.0 * np.pi / 0.5
    v, a = 0.1 * rate * np.cos(rate * t), -0.1 * rate**2 * np.sin(rate * t)
    added = 1e-7 * 200.0**2 * a + 0.02 * v + 0.1 * np.sign(v)
    moving = np.abs(v) > 1e-6
    difference = (runs[1].torque - runs[0].torque)[moving, k]
    # the rotor's reaction turns the trunk, on springs, by some 1e-4 rad: the leg feels it
    assert np.abs(difference - added[moving]).max() < 0.02 * np.abs(added).max()


def test_standing_carries_the_weight_without_servos() -> None:
    """No servo sags: the joints stay, and the base comes to rest on its feet."""
    robot = hp.load_robot("athena")
    trace = hp.simulate(
        hp.Scene(robot, prescribed=True), hp.HoldPosture(), duration=2.0, accuracy=1e-7
    )
    assert np.array_equal(trace.q[:, 7:], np.broadcast_to(robot.posture, trace.q[:, 7:].shape))
    assert trace.normal_force[-1].sum() == pytest.approx(robot.total_mass * 9.81, rel=1e-5)
    moments = hp.results.joint_moments(trace)
    assert np.abs(moments.axis_residual[-1]).max() < 1e-6


def test_what_cannot_be_prescribed_is_refused(robot: hp.Robot) -> None:
    scene = hp.Scene(robot, prescribed=True)
    jumps = hp.motion.SampledTrajectory([0.0, 0.1], np.tile(robot.posture, (2, 1)), limited=False)
    with refused(hp.errors.ParameterError, "Scene.prescribed", True, about=("set-points",)):
        hp.simulate(scene, jumps, duration=0.2)
    with refused(hp.errors.ParameterError, "Scene.prescribed", True, about=("commanded",)):
        hp.Session(scene)
    with refused(hp.errors.ParameterError, "Scene.prescribed", True, about=("commanded",)):
        hp.simulate(scene, hp.FootControl(hp.Gait.tetrapod()), duration=0.2)
    with refused(hp.errors.ParameterError, "Scene.prescribed", True, about=("LostLeg",)):
        hp.Scene(robot, prescribed=True, loads=[hp.LostLeg(leg="lf", start=1.0)])
    with refused(hp.errors.ParameterError, "Scene.prescribed", 1):
        hp.Scene(robot, prescribed=1)  # type: ignore[arg-type]
    beside = robot.stand()
    q = beside.q.copy()
    q[7] += 0.01
    about = (robot.joint_names[0], "0.01", "Scene.prescribed")
    with refused(hp.errors.StateError, about=about):
        hp.simulate(scene, hp.HoldPosture(), duration=0.1, initial=hp.State(q, beside.v))
