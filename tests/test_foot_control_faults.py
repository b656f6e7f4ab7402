"""Foot control when something is wrong: readings, ground, legs, plans, parameters, other robots."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from foot_control_runs import SEARCH, reading, recall, robot, standing
from refusals import refused
from test_foot_control_parts import PUSHED, T, loads_on, made, ticks

import hexapod_pin as hp
from hexapod_pin.control import leg_group
from hexapod_pin.control.feedback import Measurement
from hexapod_pin.control.foot_control.law import TARGET_SIZE
from hexapod_pin.control.foot_control.leg_model import known_joints, known_scene
from hexapod_pin.control.foot_control.stability import spectral_radius
from hexapod_pin.control.registry import read_controller
from hexapod_pin.errors import SensorError
from hexapod_pin.robot.loading.load_options import LoadOptions

NAME, PARTS = "kharagpur", hp.foot_control
TRIPOD = hp.Gait.tripod(lift=0.03)
RIPPLE = hp.Gait.ripple().model_dump()
JOINT = robot(NAME).joint_names[4]
FOOT = robot(NAME).feet[2].name
FAULTS = [
    ("q", (1, 4), f"q of {JOINT}"), ("rotation", (1, 2, 1), "rotation"),
    ("foot_force", (1, 2, 1), f"foot_force of {FOOT}"),
]  # fmt: skip


def full(**parts: Any) -> hp.FootControl:
    return hp.FootControl(
        TRIPOD, slip=hp.foot_control.SlipPid(bandwidth=4.0),
        suspension=hp.foot_control.VirtualSuspension(), touch_down=hp.foot_control.TouchDown(),
        levelling=hp.foot_control.Levelling(), **parts,
    )  # fmt: skip


@pytest.mark.parametrize(("number", "fault"), list(enumerate(FAULTS)))
def test_a_reading_that_is_no_number_is_named(number, fault):
    (field, place, reading), value = fault, (np.nan, np.inf, -np.inf)[number]
    measured = loads_on(NAME, PUSHED, time=1.25)
    arrays = {name: array for name, array in vars(measured).items() if name != "time"}
    rows = {name: np.repeat(array, 3, axis=0) for name, array in arrays.items()}
    rows[field][place] = value
    control = full()
    state = control.start(hp.Scene(robot(NAME)), 3)
    fault = {"reading": reading, "value": value, "time": 1.25, "row": 1}
    with refused(hp.errors.SensorError, about=(reading, "1.25", "1"), **fault):
        control.update(1.3, replace(measured, **rows), state)


def test_a_foot_that_never_touches_searches_to_its_limit_and_no_further():
    force = PUSHED.copy()
    force[1] = 0.0
    parts = {
        "touch_down": hp.foot_control.TouchDown(search_depth=0.02),
        "slip": hp.foot_control.SlipPid(anticipates=False),
    }
    law = made(suspension=hp.foot_control.VirtualSuspension(travel=0.002), **parts)
    target, memory = ticks(law, [loads_on(NAME, force)] * 400)
    offset, mode = recall(memory, "offset")[:, 1, 2], recall(memory, "mode")[:, 1]
    assert offset.min() == pytest.approx(-0.02, abs=2e-3)
    assert recall(memory, "share")[-1, 1] == 0.0  # others carry the robot; it searches
    assert recall(memory, "travel")[-1, 1] == pytest.approx(0.0, abs=1e-8)
    lost = int(np.argmax(mode == SEARCH))
    assert lost * T == pytest.approx(0.3, abs=0.011)
    speed = np.diff(offset[lost : lost + 30]) / T
    assert speed == pytest.approx(np.full(29, -0.1), abs=0.02)
    assert np.isfinite(target).all()


def angles_for(law, feet: np.ndarray) -> np.ndarray:
    rest = np.zeros((*feet.shape[:2], TARGET_SIZE - 3))
    return law.set_points(0.0, np.concatenate([feet, rest], axis=2))[0]


def test_targets_out_of_reach_are_approached():
    law = made("athena", standing())
    plan = law.walk.table.at(law.lead)[:, :3]
    six, feet = leg_group(robot("athena")), np.array(plan)
    feet[2] += [0.0, 0.0, -0.4]
    feet[4] += [0.0, -0.01, 0.0]
    angles = angles_for(law, feet[None])[0]
    places = [leg.forward(angles[i]) for leg, i in zip(six.legs, six.joint_index, strict=True)]
    share = (places[2] - plan[2])[2] / -0.4
    assert share in (pytest.approx(0.75), pytest.approx(0.5), pytest.approx(0.25))
    assert places[2][:2] == pytest.approx(plan[2, :2], abs=1e-9)
    others = [0, 1, 3, 4, 5]
    assert np.array(places)[others] == pytest.approx(feet[others], abs=1e-9)
    with refused(hp.errors.ReachError, leg="lr"):
        six.legs[2].inverse(feet[2])
    near = np.array(plan)
    near[0, 2] += 0.01
    both = angles_for(law, np.stack([feet, near]))
    assert np.array_equal(both[1], angles_for(law, near[None])[0])
    assert np.array_equal(both[0], angles)


def test_what_feet_cannot_follow_is_refused():
    loose = hp.Servo(kp={"coxa": 0.0, "femur": 9.0, "tibia": 9.0}, kd=1.0)
    scene = hp.Scene(robot("athena"), servo=loose)
    control = hp.FootControl(hp.Gait.tripod(), slip=hp.foot_control.SlipPid())
    with refused(hp.errors.ParameterError, "Servo.kp", 0.0, allowed=(0,)):
        hp.simulate(scene, control, duration=0.1)
    far = hp.motion.VelocityCommand(time=[0.0], forward=[0.5])
    control = hp.FootControl(hp.KinematicControl(hp.Gait.tripod(), velocity=far))
    with refused(hp.errors.ReachError) as caught:
        hp.simulate(hp.Scene(robot("athena")), control, duration=4.0)
    assert caught.value.excess > 0.0


@pytest.mark.parametrize(
    ("make", "name", "value", "about"),
    [
        (lambda: hp.FootControl(hp.HoldPosture()), "FootControl.walk", "HoldPosture", ()),
        (lambda: hp.FootControl(TRIPOD, period=0.0), "FootControl.period", 0.0, ()),
        (lambda: hp.FootControl(TRIPOD, sensors="good"), "FootControl.sensors", "good", ()),
        (lambda: PARTS.SlipPid(signal="both"), "SlipPid.signal", "both", ("'force'", "'slip'")),
        (lambda: PARTS.TouchDown(earliest=2.0), "TouchDown.earliest", 2.0, ("1",)),
        (lambda: PARTS.ForceTargets(sole="rubber"), "ForceTargets.sole", "rubber", ()),
        (lambda: PARTS.VirtualSuspension(load=-1.0), "VirtualSuspension.load", -1.0, ('"split"',)),
    ],
)
def test_parameters_out_of_range_are_named(make, name, value, about):
    with refused(hp.errors.ParameterError, name, value, about=about):
        make()


@pytest.mark.parametrize(
    ("change", "name", "value"),
    [
        ({"slip": 3}, "controller.slip", 3), ({"gait": RIPPLE}, "controller.gait", RIPPLE),
        ({"slip": {"gain": 1.0}}, "SlipPid.gain", 1.0), ({"walk": None}, "controller.kind", None),
        ({"walk": {"kind": "hold"}}, "FootControl.walk", "HoldPosture"),
    ],
)  # fmt: skip
def test_mistakes_in_a_text_are_named(change, name, value):
    assert isinstance(read_controller(full().to_dict()), hp.FootControl)
    with refused(hp.errors.ParameterError, name, value):
        read_controller(full().to_dict() | change)


# gears with free play, which the controller does not know

GAIT = hp.Gait.tripod(stroke=0.06, cycle_time=1.2)
CONTROL = hp.FootControl(GAIT, slip=hp.foot_control.SlipPid())


def played(play: float | None) -> hp.Scene:
    """Return a scene of gears with free play from edge to edge [rad]."""
    robot = hp.load_robot("kharagpur", options=LoadOptions(backlash=play))
    motor = hp.drive.identified_drive("MX-64").motor(12.0)
    stops = hp.JointStops(stiffness=600.0, dissipation=0.3, gap_stiffness=1000.0)
    return hp.Scene(robot, servo=hp.Servo(kp=60.0, kd=1.2, motor=motor), stops=stops)


def test_commands_and_readings_are_those_of_the_motors() -> None:
    loose, tight = played(0.0087), played(None)
    wide = known_joints(loose.robot)
    np.testing.assert_array_equal(CONTROL.posture(loose)[wide], CONTROL.posture(tight))
    assert known_scene(loose).robot.model == tight.robot.model and known_scene(tight) is tight
    assert spectral_radius(CONTROL, loose) == spectral_radius(CONTROL, tight)
    rng, here = np.random.default_rng(3), CONTROL.posture(tight)
    commands, states = [], [CONTROL.start(tight, 2), CONTROL.start(loose, 2)]
    readings = vars(reading(NAME, batch=2, foot_force=rng.normal(size=(2, 6, 3)) + [0, 0, 8.0]))
    readings |= {"q": here + 0.01 * rng.normal(size=(2, 18)), "torque": rng.normal(size=(2, 18))}
    for case, state in zip((tight, loose), states, strict=True):
        given = dict(readings)
        if case is loose:
            for name in ("q", "v", "torque"):
                given[name] = rng.normal(size=(2, 36))
                given[name][:, wide] = readings[name]
        command, _ = CONTROL.update(0.4, Measurement(**given), state)
        commands.append(command)
    np.testing.assert_array_equal(commands[1].q[:, wide], commands[0].q)
    assert not np.delete(commands[1].q, wide, axis=1).any()
    given["q"] = given["q"].copy()
    given["q"][1, wide[4]] = np.nan
    with refused(SensorError, about=(tight.robot.joint_names[4],)):
        CONTROL.update(0.4, Measurement(**given), states[1])
