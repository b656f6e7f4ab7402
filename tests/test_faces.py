"""A sphere on two faces of the ground, deep in both: what each of them remembers is its own."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.validation.cases import bodies

FALLS = [
    (701.0, 0.46, 0.014, (0.4, -0.21, -0.53), -18.0),
    (416.1, 0.225, -0.0054, (0.287, -0.224, -0.652), 14.0),
]
"""Stiffness [N/m], angle of the ramp [rad], place [m], velocity [m/s], spin [rad/s] of a 1 kg ball.

It sinks by more than its radius. Where contacts were told apart by the state that a method had
looked at last, methods differed by 3e-4 to 3e-3 m.
"""


def rolled(fall: tuple[Any, ...], **how: object) -> hp.Trace:
    """Return how a ball falls into the corner before a ramp."""
    stiffness, angle, place, speed, spin = fall
    radius = 0.02
    robot = bodies.ball(radius, inertia=0.4 * radius**2)
    contact = hp.Contact(
        normal=hp.contact.HuntCrossley(stiffness=stiffness, exponent=1.0, dissipation=0.2),
        friction=hp.contact.StickSlip(mu=0.5, stiffness=2e3, damping=10.0),
    )
    scene = hp.Scene(
        robot, terrain=hp.terrain.Ramp(angle=angle, run=0.5, start=0.0), contact=contact
    )
    start = bodies.state(robot, (place, 0.0, 0.035), speed, spin=(0.0, spin, 0.0))
    settings = {"duration": 0.3, "initial": start, "sample": 0.01, **how}
    return hp.simulate(scene, hp.HoldPosture(), **settings)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("fall", "method", "accuracy", "allowed"),
    [(FALLS[0], "extrapolated-euler", 1e-8, 1e-7), (FALLS[1], "ndf", 1e-9, 1e-8)],
)
def test_methods_agree_where_a_face_begins_or_ends_to_hold_a_ball_that_is_deep_in_it(
    fall: tuple[Any, ...], method: str, accuracy: float, allowed: float
) -> None:
    """The normal force jumps there; the bristle of the other face goes on."""
    truth = rolled(fall, method="dop853", accuracy=1e-11, estimate=False)
    found = rolled(fall, method=method, accuracy=accuracy, estimate=False)
    jumps = np.abs(np.diff(truth.foot_force[:, 0, 2]))
    assert jumps.max() > 3.0  # it does jump
    assert np.abs(found.q - truth.q).max() < allowed


def settled(scene, start, duration: float, method: str, accuracy: float) -> hp.Trace:
    return hp.simulate(
        scene, hp.HoldPosture(), duration=duration, sample=0.01, initial=start, method=method,
        accuracy=accuracy, estimate=False,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("height", "beyond", "speed"),
    [(0.0167, 5e-4, -0.3), (0.005, 2e-3, -0.3), (0.0167, 1e-3, -0.05)],
)
def test_a_ball_that_rolls_from_an_edge_onto_its_face_remembers_its_touch_down(
    height: float, beyond: float, speed: float
) -> None:
    """The parallel face below is as near in normal; taken for it, methods differed by 1e-4 m."""
    radius = 0.02
    robot = bodies.ball(radius, inertia=0.4 * radius**2)
    scene = hp.Scene(
        robot, terrain=hp.terrain.Ledge(height=height, edge=0.0), contact=hp.Contact.accurate()
    )
    above = height + np.sqrt(radius**2 - beyond**2) - 5e-5
    start = bodies.state(robot, (beyond, 0.0, above), (speed, 0.02, 0.0))

    def rolled_by(method: str, accuracy: float) -> np.ndarray:
        return settled(scene, start, 0.1, method, accuracy).q

    truth = rolled_by("dop853", 1e-10)
    for method, accuracy in (("dop853", 1e-8), ("ndf", 1e-8), ("extrapolated-euler", 1e-8)):
        assert np.abs(rolled_by(method, accuracy) - truth).max() < 5e-8


def test_a_face_that_begins_under_a_ball_is_touched_with_the_speed_that_it_has_there() -> None:
    """A ball rolls down a ramp, 1 mm deep in it, into the corner with level ground.

    Taken where a method had looked first, the speed depended on its steps: 1e-6 m at any accuracy.
    """
    radius, stiffness, slope = 0.06, 1e4, math.tan(0.14)
    robot = bodies.ball(radius, inertia=0.4 * radius**2)
    contact = hp.Contact(
        normal=hp.contact.Restitution(
            stiffness=stiffness, exponent=1.0, restitution=0.3, model="exact"
        ),
        friction=hp.Contact.accurate().friction,
    )
    ramp = hp.terrain.Ramp(angle=-0.14, run=0.4, start=-0.3)
    scene = hp.Scene(robot, terrain=ramp, contact=contact)
    height = -0.3 * slope + radius * math.hypot(1.0, slope) - 9.81 / stiffness
    start = bodies.state(
        robot, (0.0, 0.0, height), (0.4, 0.0, -0.4 * slope),
        spin=(0.0, 0.4 * math.hypot(1.0, slope) / radius, 0.0),
    )  # fmt: skip

    def rolled_by(method: str, accuracy: float) -> hp.Trace:
        return settled(scene, start, 0.4, method, accuracy)

    truth = rolled_by("dop853", 1e-11)
    assert truth.foot_gap.min() < -5e-4
    # Single runs: what steps lose adds up to ten times the accuracy; it was 140 to 1400 times.
    for method, accuracy in (("ndf", 1e-8), ("ndf", 1e-10), ("extrapolated-euler", 1e-8)):
        found = rolled_by(method, accuracy)
        assert np.abs(found.q - truth.q).max() < 20.0 * accuracy


SINGLE = {"method": "dop853", "accuracy": 1e-6, "estimate": False}


@pytest.mark.parametrize("how", [SINGLE, {"step": 1e-4}])
def test_a_run_cut_where_two_faces_hold_has_the_bits_of_one_without_a_cut(how):
    """A checkpoint knows on which face each contact stands."""
    whole = rolled(FALLS[0], **how)
    for cut in (0.05, 0.1, 0.2):
        first = rolled(FALLS[0], duration=cut, **how)
        rest = round(0.3 - cut, 3)
        second = rolled(FALLS[0], duration=rest, initial=first.checkpoint, **how)
        assert np.array_equal(np.concatenate([first.q, second.q[1:]]), whole.q)
        assert first.checkpoint.contacts.shape == (2, 12)


def test_a_checkpoint_without_faces_is_taken() -> None:
    """Those of earlier releases have six numbers per contact; rows must be of one length."""
    kept = rolled(FALLS[0], duration=0.05, step=1e-4).checkpoint.to_dict()
    earlier = {**kept, "contacts": [row[:6] for row in kept["contacts"]]}
    again = hp.results.Checkpoint.from_dict(earlier)
    assert again.contacts.shape == (2, 6)
    assert rolled(FALLS[0], duration=0.05, initial=again, step=1e-4).time[-1] == 0.1
    mixed = {**kept, "contacts": [kept["contacts"][0], kept["contacts"][1][:6]]}
    with refused(hp.errors.StateError, about=("checkpoint.contacts",)):
        hp.results.Checkpoint.from_dict(mixed)
    short = {**kept, "contacts": [row[:5] for row in kept["contacts"]]}
    with refused(hp.errors.ParameterError, "checkpoint.contacts[0]", allowed=(12,)):
        hp.results.Checkpoint.from_dict(short)
