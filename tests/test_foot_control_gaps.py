"""Foot control of a robot whose gears have free play, which it does not know."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control.foot_control.leg_model import known_joints, known_scene
from hexapod_pin.control.foot_control.stability import spectral_radius
from hexapod_pin.errors import SensorError
from hexapod_pin.robot.loading.load_options import LoadOptions

GAIT = hp.Gait.tripod(stroke=0.06, cycle_time=1.2)
CONTROL = hp.FootControl(GAIT, slip=hp.foot_control.SlipPid())


def scene(play: float | None) -> hp.Scene:
    """Return a scene of gears with free play from edge to edge [rad]."""
    robot = hp.load_robot("kharagpur", options=LoadOptions(backlash=play))
    motor = hp.drive.identified_drive("MX-64").motor(12.0)
    stops = hp.JointStops(stiffness=600.0, dissipation=0.3, gap_stiffness=1000.0)
    return hp.Scene(robot, servo=hp.Servo(kp=60.0, kd=1.2, motor=motor), stops=stops)


def test_the_known_robot_is_the_one_without_play() -> None:
    """Model, posture, gains and stability are those of the robot loaded without play."""
    loose, tight = scene(0.0087), scene(None)
    known = known_scene(loose)
    assert known.robot.model == tight.robot.model
    assert not known.robot.gaps and not known.robot.held
    np.testing.assert_array_equal(known.robot.posture, tight.robot.posture)
    assert known_scene(tight) is tight
    assert spectral_radius(CONTROL, loose) == spectral_radius(CONTROL, tight)


def test_commands_and_readings_are_those_of_the_motors() -> None:
    """Of the same readings a tick commands the same, whatever the gaps' angles are; faults name."""
    loose, tight = scene(0.0087), scene(None)
    wide = known_joints(loose.robot)
    np.testing.assert_array_equal(CONTROL.posture(loose)[wide], CONTROL.posture(tight))
    rng, here = np.random.default_rng(3), CONTROL.posture(tight)
    commands, states = [], [CONTROL.start(tight, 2), CONTROL.start(loose, 2)]
    readings = {
        "q": here + 0.01 * rng.normal(size=(2, 18)), "v": 0.1 * rng.normal(size=(2, 18)),
        "torque": rng.normal(size=(2, 18)), "rotation": np.tile(np.eye(3), (2, 1, 1)),
        "angular_velocity": np.zeros((2, 3)), "acceleration": np.tile([0.0, 0.0, 9.81], (2, 1)),
        "foot_force": rng.normal(size=(2, 6, 3)) + [0.0, 0.0, 8.0],
        "loaded": np.ones((2, 6), dtype=bool),
    }  # fmt: skip
    for case, state in zip((tight, loose), states, strict=True):
        given = dict(readings)
        if case is loose:
            for name in ("q", "v", "torque"):
                given[name] = rng.normal(size=(2, 36))
                given[name][:, wide] = readings[name]
        command, _ = CONTROL.update(0.4, hp.control.Measurement(0.4, **given), state)
        commands.append(command)
    np.testing.assert_array_equal(commands[1].q[:, wide], commands[0].q)
    assert not np.delete(commands[1].q, wide, axis=1).any()
    given["q"] = given["q"].copy()
    given["q"][1, wide[4]] = np.nan
    with refused(SensorError, about=(tight.robot.joint_names[4],)):
        CONTROL.update(0.4, hp.control.Measurement(0.4, **given), states[1])


@pytest.mark.parametrize("encoder", ["motor", "link"])
def test_through_the_firmware(encoder: str) -> None:
    """Without parts it is the plan through the same firmware, in its count of 0.09 degrees."""
    firmware = hp.drive.Firmware.dynamixel(850)
    loose = scene(0.0087)
    motor = hp.drive.identified_drive("MX-64").motor(12.0)
    driven = hp.Scene(loose.robot, servo=firmware.driven(motor), stops=loose.joint_stops)
    ends = []
    for walk in (hp.FootControl(GAIT), hp.KinematicControl(GAIT)):
        control = hp.FirmwareControl(walk, firmware, encoder=encoder)  # type: ignore[arg-type]
        trace = hp.simulate(driven, control, duration=0.05, sample=0.01, accuracy=1e-3,
                            estimate=False)  # fmt: skip
        ends.append(trace.q)
    np.testing.assert_allclose(ends[0], ends[1], atol=2.0 * np.pi / 4096, rtol=0.0)
