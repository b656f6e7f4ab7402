"""Every law and ground with every method: two that share no formula of integration end alike."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from contact_formulas import FRICTION as CREEPING
from contact_formulas import NORMAL
from refusals import refused

import hexapod_pin as hp

FRICTION = {**CREEPING, "stick-slip": hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0)}
GROUND = {
    "flat": hp.Flat(),
    "slope": hp.Slope(angle=np.radians(10.0)),
    "stairs": hp.Stairs(rise=0.01, run=0.2, count=5, start=0.35),
    "hills": hp.HeightField.random(seed=1, amplitude=0.01, wavelength=0.5),
}
SOME = list(itertools.product(NORMAL, FRICTION, GROUND))[::17]


def walk(normal: str, friction: str, ground: str, **how) -> hp.Trace:
    contact = hp.Contact(normal=NORMAL[normal], friction=FRICTION[friction])
    scene = hp.Scene(hp.load_robot("kharagpur"), terrain=GROUND[ground], contact=contact)
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.06, cycle_time=0.4))
    return hp.simulate(scene, control, duration=0.25, sample=0.01, **how)


@pytest.mark.parametrize(("normal", "friction", "ground"), SOME)
def test_x3_and_ndf_walk_alike_and_robust_near(normal: str, friction: str, ground: str) -> None:
    """X3 keeps its 1e-5 against NDF at 1e-6; the robust step, of order 1, is less than 1e-3 off."""
    case = (normal, friction, ground)
    truth = walk(*case, method="ndf", accuracy=1e-6)
    assert np.abs(walk(*case, accuracy=1e-5).q - truth.q).max() < 1e-5
    assert np.abs(walk(*case, method="robust", step=2.5e-4).q - truth.q).max() < 1e-3


def test_a_spring_without_damper_is_for_fixed_steps() -> None:
    """Stick-slip without damping has no rate of its own: adaptive methods say so."""
    contact = hp.Contact(
        normal=NORMAL["hertz"],
        friction=hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=0.0),
    )
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=contact)
    run = hp.simulate(scene, hp.HoldPosture(), duration=0.05, method="robust")
    assert run.counters["steps"] == 50
    with refused(hp.errors.ParameterError, "StickSlip.damping", 0.0, about=("fixed-step",)):
        hp.simulate(scene, hp.HoldPosture(), duration=0.05, method="ndf")
