"""Foot control of a standing robot as a linear loop: its matrices, its borders, its refusals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from studies.foot_control import standing_growth
from studies.foot_control.gain_borders import QUANTITIES, controller, predicted_border
from studies.foot_control.standing_growth import STAND, Stand

import hexapod_pin as hp
from hexapod_pin.control.foot_control.controller import FootControl
from hexapod_pin.control.foot_control.linear_law import NEUTRAL
from hexapod_pin.control.foot_control.parameters import ForceTargets, SlipPid, VirtualSuspension
from hexapod_pin.control.foot_control.stability import (
    linear_law,
    refuse_unstable,
    spectral_radius,
    stable_range,
    stance_loop,
    with_parameter,
)
from hexapod_pin.control.foot_control.stance_model import StanceModel
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.ground.contact import Contact


@pytest.fixture(scope="module")
def kharagpur() -> hp.Scene:
    return hp.Scene(hp.load_robot("kharagpur"))


@pytest.fixture
def short_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(standing_growth, "SETTLED", 3.0)
    monkeypatch.setattr(standing_growth, "ACCURACY", 1e-7)


@pytest.mark.parametrize("name", ["kharagpur", "athena"])
def test_static_forces_carry_the_weight(name: str) -> None:
    scene = hp.Scene(hp.load_robot(name))
    model, stance = scene.robot.model, StanceModel.of(scene)
    needed = pin.rnea(model, model.createData(), scene.robot.stand().q, np.zeros(24), np.zeros(24))
    given = np.einsum("fn,f->n", stance.jacobian[:, 2], stance.load)
    given[6:] += stance.torque
    assert given == pytest.approx(needed, abs=1e-9 * needed[2])
    assert stance.load.sum() == pytest.approx(9.81 * scene.robot.total_mass, rel=1e-12)


def test_a_tick_of_the_suspension_is_that_of_its_equation(kharagpur: hp.Scene) -> None:
    """Implicit Euler of m z'' + c z' + k z = f, found in the differenced law's eigenvalues."""
    scene, part, h = kharagpur, VirtualSuspension(), 0.005
    law = linear_law(FootControl(STAND, suspension=part), scene, StanceModel.of(scene))
    mass, damper, stiffness = part.gains(scene.robot.total_mass * 9.81, 1.5 * h)
    system = np.array([[0.0, 1.0], [-stiffness / mass, -damper / mass]])
    expected = np.linalg.eigvals(np.linalg.inv(np.eye(2) - h * system))
    found = np.linalg.eigvals(law.memory)
    assert law.fields == ("q", "rotation", "foot_force")
    moving = found[np.abs(found) > 1e-6]  # the others are those of the last tick's loads and places
    assert len(moving) == 12
    for one in moving:
        assert np.abs(one - expected).min() < 1e-6


@pytest.mark.usefixtures("short_runs")
def test_simulation_grows_beyond_the_border_alone() -> None:
    """At 0.9 of the border it decays, at 1.1 it grows at the predicted rate."""
    scene, quantity = hp.Scene(hp.load_robot("kharagpur")), "suspension.frequency"
    sensors = hp.sensors.Sensors(delay=0.003)
    control = replace(controller(quantity, 0.004), sensors=sensors)
    border = predicted_border(control, scene, quantity)
    stand = Stand.settled(scene, with_parameter(control, quantity, 0.5))
    below, above = (with_parameter(control, quantity, x * border) for x in (0.9, 1.1))
    assert stand.growth(below) < 0.0
    rate = math.log(spectral_radius(above, scene, touch_speed=0.0)) / control.period
    assert stand.growth(above) == pytest.approx(rate, rel=0.15)


@pytest.mark.usefixtures("short_runs")
def test_borders_beside_force_targets_are_those_of_the_simulation() -> None:
    """Decays 2 % below the predicted border and grows 2 % above it, sticking contact."""
    scene, quantity = hp.Scene(hp.load_robot("athena")), QUANTITIES[5]
    control = controller(quantity, 0.005)
    border = predicted_border(control, scene, quantity)
    stand = Stand.settled(scene, with_parameter(control, "slip.ki", 0.05 * border))
    below, above = (with_parameter(control, "slip.ki", x * border) for x in (0.98, 1.02))
    assert stand.growth(below) < 0.0 < stand.growth(above)


def test_two_slow_drifts_are_not_shaking() -> None:
    """Beside two-sided targets feet creep on S1's contact: a pair of 5000 s is neutral."""
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=Contact.s1())
    aim = ForceTargets(sole="contact", deviation="target")
    control = FootControl(hp.Gait.tripod(), slip=SlipPid(), force_targets=aim)
    stance = control.gait.duty * control.gait.cycle_time
    low, high = stable_range(control, scene, "slip.ki", drift_time=stance)
    assert low == 0.0 and high == pytest.approx(0.0043, rel=0.02)
    loop = stance_loop(control, scene)
    values = np.linalg.eigvals(loop.matrix(linear_law(control, scene, loop.stance)))
    rates = np.log(values[np.abs(values) > 1.0 + NEUTRAL]) / control.period
    assert 0.0 < np.abs(rates).max() < 0.02
    refuse_unstable(control, scene)


def test_ends_of_a_range_are_borders(kharagpur: hp.Scene) -> None:
    scene = kharagpur
    control = FootControl(STAND, suspension=VirtualSuspension(), delay=0.01)
    low, high = stable_range(control, scene, "suspension.frequency")
    assert low == 0.0
    for share, stable in ((0.99, True), (1.01, False)):
        changed = with_parameter(control, "suspension.frequency", share * high)
        assert (spectral_radius(changed, scene) < 1.0) == stable
    with pytest.raises(UnknownNameError):
        stable_range(control, scene, "suspension.mass")
    with refused(ParameterError, "StanceModel.feet", 3):
        StanceModel.of(kharagpur, ["lf_foot", "lm_foot", "lr_foot"])
    with refused(ParameterError, "FootControl.slip", None):
        stable_range(control, scene, "slip.ki")


def test_unstable_gains_are_refused_with_their_range() -> None:
    scene = hp.Scene(hp.load_robot("athena"))
    good = FootControl(STAND, suspension=VirtualSuspension(frequency=1.5), delay=0.02)
    refuse_unstable(good, scene)
    bad = replace(good, suspension=VirtualSuspension(frequency=6.0))
    with refused(ParameterError, "suspension.frequency", 6.0) as first:
        bad.start(scene, 1)
    with pytest.raises(ParameterError) as second:
        refuse_unstable(bad, scene)
    assert second.value is first.value  # kept
