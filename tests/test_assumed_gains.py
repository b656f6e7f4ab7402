"""Default gains: from the effort where that is plausible, else from weight and leg length."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.scene_options import chosen_servo
from hexapod_pin.drive.servo import SAG, assumed_gains
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.holding_torque import standing_torque
from hexapod_pin.robot.robot import leg_length


def with_effort(folder: Path, effort: float) -> hp.Robot:
    """Return kharagpur with another effort [N m] at every joint."""
    path = folder / f"effort_{effort:g}.urdf"
    text = hp.urdf_path("kharagpur").read_text()
    path.write_text(text.replace('effort="6"', f'effort="{effort:g}"'))
    return hp.load_robot(path)


SLIDES = "<axis xyz='1 0 0'/><limit lower='-0.01' upper='0.01' effort='50' velocity='1'/>"
SOLID = (
    "<inertial><mass value='1e-5'/><inertia ixx='1e-9' iyy='1e-9' izz='1e-9' ixy='0' ixz='0' "
    "iyz='0'/></inertial>"
)


def with_springs(folder: Path) -> hp.Robot:
    text = hp.urdf_path("kharagpur").read_text()
    text = re.sub(r'(<joint name="\w\w_foot_joint" type=")fixed">', rf'\1prismatic">{SLIDES}', text)
    path = folder / "springs.urdf"
    path.write_text(re.sub(r'(<link name="\w\w_foot">)', rf"\1{SOLID}", text))
    return hp.load_robot(path, feet=[foot.name for foot in hp.load_robot("kharagpur").feet])


def test_a_stiffness_that_is_damped_or_forced_is_taken() -> None:
    """1e7 N m/rad walk in 3 s with 0.02 s of damping, in 75 s with the assumed one."""
    robot = hp.load_robot("kharagpur")
    for kp, kd, force in ((1e7, 2e5, False), (1e7, None, True), (2.4e6, 0.0, False)):
        assert chosen_servo(robot, kp, kd, force).kp == kp
    with refused(ParameterError, name="--kp", value=2.5e6, about=("--kd 5e+04 damps it",)):
        chosen_servo(robot, 2.5e6, None, force=False)


def test_foot_springs_get_their_own_gains(tmp_path: Path) -> None:
    """Half of the weight on a spring less the foot: 0.01 of the leg's length; turning as before."""
    robot = with_springs(tmp_path)
    gains, plain = assumed_gains(robot), assumed_gains(hp.load_robot("kharagpur"))
    spring, turning = "lm_foot_joint", "lm_femur_joint"
    assert (gains.kp[turning], gains.kd[turning]) == (plain.kp, plain.kd)
    force = 0.5 * 9.81 * robot.total_mass
    assert gains.kp[spring] == pytest.approx(force / (0.01 * leg_length(robot)), rel=1e-3)
    time = 2.0 * math.sqrt(0.01 * leg_length(robot) / 9.81)
    assert gains.kd[spring] / gains.kp[spring] == pytest.approx(time, rel=1e-12)
    assert gains.rule is not None and gains.rule.startswith("sliding joints give way by 3 mm")
    kp, _ = hp.Servo.for_robot(robot).gains(robot)
    assert kp.tolist() == [gains.kp[name] for name in robot.joint_names]


@pytest.mark.parametrize("effort", [10000.0, 0.05])
def test_absurd_efforts_do_not_make_gains(effort: float, tmp_path: Path) -> None:
    """The same gains whatever the effort: 1.65 N m / 0.01 rad; critical for half of the mass."""
    robot = with_effort(tmp_path, effort)
    servo, load = hp.Scene(robot).servos, float(max(standing_torque(robot)))
    assert servo.kp == pytest.approx(load / 0.01, rel=1e-12)
    mass, arm = 0.5 * robot.total_mass, load / (0.5 * robot.total_mass * 9.81)
    assert servo.kd == pytest.approx(2.0 * math.sqrt(servo.kp * mass * arm**2), rel=1e-12)
    assert servo.assumed and servo.rule is not None and f"effort of {effort:g} N m" in servo.rule
    assert any("from weight and leg length" in line for line in hp.Scene(robot).assumed)
    assert hp.JointStops.for_robot(robot).stiffness == pytest.approx(2.5 * servo.kp, rel=1e-12)


def test_the_border_is_where_the_load_of_standing_is(tmp_path: Path) -> None:
    load = float(max(standing_torque(hp.load_robot("kharagpur"))))
    for share, plausible in ((0.99, False), (1.01, True), (19.9, True), (20.1, False)):
        rule = assumed_gains(with_effort(tmp_path, share * load)).rule
        assert (rule is None) is plausible
    robot = with_effort(tmp_path, 10000.0)
    servo = hp.Servo.for_robot(robot, kp=50.0, kd=1.0)
    assert (servo.kp, servo.kd, servo.assumed, servo.rule) == (50.0, 1.0, False, None)
    half = hp.Servo.for_robot(robot, kp=50.0)
    assert half.assumed and half.kd == assumed_gains(robot).kd
    scene = hp.Scene(robot)
    assert hp.Scene.from_toml(scene.to_toml()).servos == scene.servos


def test_a_robot_of_absurd_effort_stands_with_the_sag_that_is_promised(tmp_path: Path) -> None:
    """On six feet without friction each carries a sixth, not half: about a third of 0.01 rad."""
    contact = hp.Contact.accurate().with_mu(1e-4)
    scene = hp.Scene(with_effort(tmp_path, 10000.0), contact=contact)
    trace = hp.simulate(scene, hp.HoldPosture(), duration=1.0)
    sag = np.abs(trace.q[-1, 7:] - trace.q_ref[-1])
    assert SAG / 4.0 < sag.max() < SAG / 2.5
    assert np.abs(trace.v[-1]).max() < 1e-3  # damped
