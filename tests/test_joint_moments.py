"""Joint moments: statics by hand, the trace's own torques, loads, and what is refused."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.run_record import RunCase

G = 9.81
LEGS = ("lf", "lm", "lr", "rf", "rm", "rr")
PARTS = ("coxa", "femur", "tibia")


def standing(duration: float = 3.0, **scene: object) -> hp.Trace:
    robot = hp.load_robot("kharagpur")
    # steps of 1e-8 m: what is left of the motion after 3 s is below what is compared
    return hp.simulate(hp.Scene(robot, **scene), hp.HoldPosture(), duration=duration, accuracy=1e-8)


@pytest.fixture(scope="module")
def stand() -> hp.Trace:
    return standing()


@pytest.fixture(scope="module")
def walk() -> hp.Trace:
    gait = hp.Gait.tetrapod(stroke=0.14, cycle_time=1.2)
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return hp.simulate(scene, hp.KinematicControl(gait), duration=3.6, accuracy=1e-5)


def test_standing_by_hand(stand: hp.Trace) -> None:
    """Foot force times lever, less the weights of the links between, at femur and coxa joints.

    Link centres are those of the trace's configuration by forward kinematics. The stand still
    settles by 5e-10 m in an interval, and its accelerations are not counted here.
    """
    found, robot = hp.results.joint_moments(stand), hp.load_robot("kharagpur")
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, stand.q[-1])
    for leg in LEGS:
        ids = [robot.model.getJointId(f"{leg}_{part}_joint") for part in PARTS]
        foot = stand.foot(f"{leg}_foot")
        contact = stand.foot_position[-1, foot] - [0.0, 0.0, 0.01]
        for number in range(3):
            origin, rotation = data.oMi[ids[number]].translation, data.oMi[ids[number]].rotation
            total = -np.cross(contact - origin, stand.foot_force[-1, foot])
            for link in ids[number:]:
                body = robot.model.inertias[link]
                arm = data.oMi[link].act(body.lever) - origin
                total -= np.cross(arm, [0.0, 0.0, -G * body.mass])
            joint = found.joint(f"{leg}_{PARTS[number]}_joint")
            assert rotation @ found.moment_vector[-1, joint] == pytest.approx(total, abs=1e-7)
            assert found.moment[-1, joint] == pytest.approx(np.linalg.norm(total), abs=1e-7)


def test_axis_torque_is_the_motors(stand: hp.Trace, walk: hp.Trace) -> None:
    """At rest to what is left of the motion; walking but for what happens within 2 ms.

    `trace.torque` is of instants and the moments are means: where a foot lands they differ.
    """
    at_rest = hp.results.joint_moments(stand)
    assert np.abs(at_rest.axis_residual[-100:]).max() < 1e-9
    moving = hp.results.joint_moments(walk)
    assert moving.agreement < 0.02
    assert np.percentile(np.abs(moving.axis_residual), 99.0) < 0.01
    assert np.abs(moving.motor_torque).max() > 1.0
    assert (moving.moment >= np.abs(moving.axis_torque) - 1e-12).all()


def test_trunk_is_in_balance(walk: hp.Trace) -> None:
    """Six equations that no motor enters, to 1e-3 of the weight, in the middle of intervals."""
    found, weight = hp.results.joint_moments(walk), 30.3
    assert np.abs(found.base_residual[:, :3]).max() < 1e-3 * weight
    assert np.abs(found.base_residual[:, 3:]).max() < 1e-3 * weight * 0.1
    window = hp.torque_budget(walk).window
    assert found.time[0] == pytest.approx(window.start + 1e-3)
    assert found.time[-1] == pytest.approx(window.end - 1e-3)
    every = hp.results.joint_moments(walk, whole=True)
    assert len(every.time) == len(walk.time) - 1
    assert every.moment[every.ends == found.ends[0]] == pytest.approx(found.moment[:1], abs=1e-14)


def test_payload_and_push_are_known() -> None:
    inertia = [0.01, 0.02, 0.015, 0.0, 0.001, 0.0]
    loads = [
        hp.Payload("base_link", mass=1.0, position=(0.1, 0.05, 0.08), inertia=inertia),
        hp.Payload("lm_tibia", mass=0.05, position=(0.0, 0.0, 0.0)),
        hp.Push("base_link", (0.0, 0.1, 0.05), force=(3.0, 2.0, 1.0), torque=(0.1, 0.2, 0.3),
                start=0.5, duration=9.0),
    ]  # fmt: skip
    trace = standing(loads=loads)
    found = hp.results.joint_moments(trace)
    assert np.abs(found.axis_residual[-100:]).max() < 1e-6
    assert np.abs(found.base_residual[-100:]).max() < 1e-6


def test_motor_turns_its_rotor_and_its_friction() -> None:
    """Rotor inertia and viscous friction are the motor's: taken off before the comparison."""
    motor = hp.Motor(stall_torque=6.0, no_load_speed=6.0, rotor_inertia=1e-6, gear_ratio=60.0,
                     viscous_friction=0.1)  # fmt: skip
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, servo=hp.Servo(kp=240.0, kd=4.8, motor=motor))
    gait = hp.Gait.tetrapod(stroke=0.1, cycle_time=0.8)
    trace = hp.simulate(scene, hp.KinematicControl(gait), duration=2.4, accuracy=1e-5)
    found = hp.results.joint_moments(trace)
    p99 = np.percentile(np.abs(found.axis_residual), 99.0)
    without = np.percentile(np.abs(found.motor_torque - found.axis_torque), 99.0)
    assert p99 < 0.02
    assert without > 5.0 * p99


def test_what_cannot_be_built_again_is_refused(walk: hp.Trace) -> None:
    with refused(ParameterError, "Trace.run.robot.urdf"):
        hp.results.joint_moments(synthetic_trace(urdf=None))
    with refused(ParameterError, "Trace.run.robot"):
        hp.results.joint_moments(synthetic_trace(urdf="<robot"))
    athena = hp.load_robot("athena").urdf
    with refused(ParameterError, "Trace.joint_names"):
        hp.results.joint_moments(
            synthetic_trace(urdf=athena.replace("lf_coxa_joint", "other_joint"))
        )
    case = hp.Case(hp.Scene(hp.load_robot("kharagpur")), hp.HoldPosture(), duration=0.1)
    text = f'{case.to_toml()}\n[[scene.loads]]\nkind = "rocket"\n'
    with refused(ParameterError, "loads[0].kind", "rocket"):
        hp.results.joint_moments(synthetic_trace(case=RunCase(text=text)))
    with refused(UnknownNameError, kind="joint", name="knee"):
        hp.results.joint_moments(walk).joint("knee")
