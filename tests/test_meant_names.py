"""Words of other simulators, and of the command line, in calls: errors name what was meant."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

import hexapod_pin as hp
from hexapod_pin.errors import ArgumentError, ParameterError

ROBOT = hp.load_robot("kharagpur")
GAIT = hp.Gait.tripod()


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (
            lambda: hp.Scene(ROBOT, mu=0.5),
            "contact=hp.Contact.accurate().with_mu(0.5) was probably",
        ),
        (lambda: hp.Scene(ROBOT, ground=hp.Flat()), "'terrain' was probably meant"),
        (lambda: hp.Scene(ROBOT, payload=1.0), "loads=[hp.loads.Payload(mass)]"),
        (lambda: hp.Scene(ROBOT, gravty=(0, 0, 0)), "'gravity' was probably meant"),
        (
            lambda: hp.simulate(hp.Scene(ROBOT), hp.KinematicControl(GAIT), duration=1.0, dt=1e-3),
            "'step' was probably meant",
        ),
        (lambda: hp.simulate(hp.Scene(ROBOT), hp.KinematicControl(GAIT)), "missing a required"),
        (
            lambda: hp.simulate(hp.Scene(ROBOT), hp.KinematicControl(GAIT), 1.0),
            "too many positional",
        ),
        (
            lambda: hp.simulate(hp.Scene(ROBOT), duration=1.0, zzz=1),
            "no argument 'zzz'. It takes scene",
        ),
    ],
)
def test_an_argument_that_does_not_exist(call: Callable[[], Any], text: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        call()
    assert text in str(caught.value)
    assert isinstance(caught.value, TypeError)


@pytest.mark.parametrize(
    ("call", "name", "text"),
    [
        (lambda: hp.Gait.tripod(stride=0.05), "Gait.stride", "'stroke' was probably meant"),
        (lambda: hp.Gait.tripod(strok=0.05), "Gait.strok", "'stroke' was probably meant"),
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


@pytest.mark.parametrize("name", ["heading", "turn_rate"])
def test_degrees_are_no_radians(name: str) -> None:
    """A heading of 90 was taken for radians: the robot walked at 116.6 degrees."""
    with pytest.raises(ParameterError, match="90 degrees are 1.571 rad"):
        hp.Gait.tripod(**{name: 90})
    with pytest.raises(ParameterError, match="45 degrees are 0.7854 rad"):
        hp.Slope(angle=0.1, heading=45)
    assert getattr(hp.Gait.tripod(**{name: -6.28}), name) == -6.28
