"""Words of other simulators, and of the command line, in calls: errors name what was meant."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest

import hexapod_pin as hp
from hexapod_pin.control.feedback import Command
from hexapod_pin.control.gait import GAITS
from hexapod_pin.errors import ArgumentError, ParameterError
from hexapod_pin.ground.contact.contact import PRESETS
from hexapod_pin.meant import ELSEWHERE, MADE_BY
from hexapod_pin.robot.loading.load_options import LoadOptions

ROBOT = hp.load_robot("kharagpur")
GAIT = hp.Gait.tripod()


def test_an_argument_that_does_not_exist() -> None:
    scene, control = hp.Scene(ROBOT), hp.KinematicControl(GAIT)
    for call, text in (
        (
            lambda: hp.Scene(ROBOT, mu=0.5),
            "contact=hp.Contact.accurate().with_mu(0.5) was probably",
        ),
        (lambda: hp.Scene(ROBOT, gravty=(0, 0, 0)), "'gravity' was probably meant"),
        (lambda: hp.simulate(scene, control, duration=1.0, dt=1e-3), "'step' was probably meant"),
        (lambda: hp.simulate(scene, control), "missing a required"),
        (lambda: hp.simulate(scene, control, 1.0), "too many positional"),
        (lambda: hp.simulate(scene, duration=1.0, zzz=1), "no argument 'zzz'. It takes scene"),
    ):
        with pytest.raises(ArgumentError, match=re.escape(text)) as caught:
            call()
        assert isinstance(caught.value, TypeError)


@pytest.mark.parametrize(
    ("call", "name", "text"),
    [
        (lambda: hp.Gait.tripod(stride=0.05), "Gait.stride", "'stroke' was probably meant"),
        (lambda: hp.Scene(ROBOT, contact="s1"), "Scene.contact", "Contact.preset('s1') makes one"),
        (lambda: hp.KinematicControl("tripod"), "KinematicControl.gait", "Gait.tripod() makes one"),
        (lambda: hp.Scene("athena"), "Scene.robot", "hp.load_robot('athena') makes one"),
        (
            lambda: hp.simulate(hp.Scene(ROBOT), GAIT, duration=1.0),
            "controller", "KinematicControl(gait) walks it",
        ),
    ],
)  # fmt: skip
def test_a_word_for_an_object(call: Callable[[], Any], name: str, text: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(text)) as caught:
        call()
    assert caught.value.name == name


class OwnFriction(hp.contact.FrictionLaw):
    """A law that the core does not have."""

    kind: Literal["own"] = "own"

    def native(self) -> Any:
        """Return a law of the core."""
        return hp.Contact.accurate().friction.native()


def test_a_law_of_ones_own_is_told_where_it_belongs() -> None:
    contact = hp.Contact.accurate()
    for name, law in (("friction", OwnFriction()), ("normal", lambda depth, rate: 0.0)):
        with pytest.raises(ParameterError, match=re.escape("docs/extending.md")) as caught:
            hp.Contact(**{**dict(contact), name: law})
        assert caught.value.name == f"Contact.{name}"
        for other in (0.7, hp.contact.SmoothStep, contact):
            with pytest.raises(ParameterError) as caught:
                hp.Contact(**{**dict(contact), name: other})
            assert "extending" not in str(caught.value)


def test_what_stands_elsewhere_and_what_makes_an_object_can_be_written() -> None:
    names = {"hp": hp, "mass": 1.0, "robot": ROBOT, "gait": GAIT}
    for text in {text for text in ELSEWHERE.values() if re.match(r"\w+=(?!.*\.\.\.)", text)}:
        fields = eval(f"dict({text})", names)
        scene = {name: value for name, value in fields.items() if name != "controller"}
        assert hp.Scene(ROBOT, **scene).robot is ROBOT
    assert MADE_BY["gait"][1] == tuple(GAITS)
    assert MADE_BY["contact"][1] == tuple(PRESETS)
    for name in GAITS:
        assert eval(MADE_BY["gait"][0].format(name), {"hp": hp}).name == name


def test_set_points_in_degrees_are_told_from_wrong_ones() -> None:
    """A tibia at 90: from 0 to 2.79 rad are allowed. 3 rad is no 3 degrees, 200 no 200 degrees."""
    tibia = ROBOT.joint_index("lf_tibia_joint")

    class Constant:
        period = 0.02

        def __init__(self, q: np.ndarray) -> None:
            self.q = q

        def start(self, scene: hp.Scene, batch: int) -> None:
            """Have no state."""

        def update(self, time: float, measurement: Any, state: None) -> tuple[Command, None]:
            return Command(np.tile(self.q, (len(measurement.q), 1))), None

    for angle, meant in ((90.0, True), (3.0, False), (200.0, False)):
        q = np.where(np.arange(18) == tibia, angle, ROBOT.posture)
        track = hp.motion.SampledTrajectory([0.0, 1.0], [q, q])
        for control in (Constant(q), hp.HoldPosture(q), track):
            with pytest.raises(ParameterError, match="lf_tibia_joint") as caught:
                hp.simulate(hp.Scene(ROBOT), control, duration=0.1)
            assert ("Degrees? 90 degrees are 1.571 rad." in str(caught.value)) == meant


def test_degrees_are_no_radians() -> None:
    """A heading of 90 was taken for radians: the robot walked at 116.6 degrees."""
    for name in ("heading", "turn_rate"):
        with pytest.raises(ParameterError, match="90 degrees are 1.571 rad"):
            hp.Gait.tripod(**{name: 90})
        assert getattr(hp.Gait.tripod(**{name: -6.28}), name) == -6.28


@pytest.mark.parametrize(
    ("call", "name", "text"),
    [
        (lambda: hp.Gait.tripod(stroke=150), "Gait.stroke", "mm? 150 mm are 0.15 m"),
        (lambda: hp.Payload("base_link", 3500), "Payload.mass", "grams? 3500 g are 3.5 kg"),
        (
            lambda: hp.Scene(ROBOT, loads=[hp.Payload("base_link", 350)]),
            "Scene.loads[0].mass", "grams? 350 g are 0.35 kg",
        ),
        (
            lambda: hp.Scene(ROBOT, servo=hp.Servo(
                kp=20, kd=0.3, motor=hp.Motor(stall_torque=1500, no_load_speed=6.0))),
            "Scene.servo.motor[lf_coxa_joint].stall_torque", "Perhaps it is 1500 N mm.",
        ),
        (
            lambda: hp.Motor(stall_torque=10, no_load_speed=6.0, mass=0.02),
            "stall_torque", "Perhaps it is 10 kgf cm: that would be 49 N m/kg.",
        ),
        (
            lambda: hp.Motor(stall_torque=1.5, no_load_speed=590, mass=0.055),
            "no_load_speed", "590 rpm are 61.8 rad/s",
        ),
        (
            lambda: hp.sizing.MotorRecord(
                model="A", voltage=12.0, stall_torque=15.0, no_load_speed=6.18, stall_current=1.5),
            "stall_torque", "Perhaps it is 15 kgf cm",
        ),
        (
            lambda: hp.load_robot(ROBOT.source, options=LoadOptions(repair=True, mass=3500)),
            "mass", "grams? 3500 g are 3.5 kg",
        ),
    ],
)  # fmt: skip
def test_numbers_in_other_units(call: Callable[[], Any], name: str, text: str) -> None:
    """What no hexapod of 0.1 to 500 kg on legs of 0.03 to 3 m can have names the unit meant."""
    with pytest.raises(ParameterError, match=re.escape(text)) as caught:
        call()
    assert caught.value.name.endswith(name)
