"""Soil under a spherical foot: Bekker's pressure over the cap, and the law next to it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import quad

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.ground.contact import SOILS, Soil, delivered_restitution

R = 0.02
SAND = Soil(exponent=1.1, frictional_modulus=1.5e6, friction_angle=0.5)


def by_quadrature(soil: Soil, depth: float, radius: float) -> float:
    """Pressure times ring area, from the axis outwards: no closed form."""
    width = math.sqrt(depth * (2 * radius - depth)) if depth < radius else radius
    modulus = soil.cohesive_modulus / width + soil.frictional_modulus

    def ring(r: float) -> float:
        sunk = depth - radius + math.sqrt(max(radius**2 - r**2, 0.0))
        return modulus * max(sunk, 0.0) ** soil.exponent * 2 * math.pi * r

    return quad(ring, 0.0, width, epsabs=0.0, epsrel=1e-10, limit=200)[0]


@pytest.mark.parametrize("name", SOILS)
@pytest.mark.parametrize("depth", [1e-4, 0.015, 0.05])
def test_force_is_the_integral_of_the_pressure(name: str, depth: float) -> None:
    """Up to the equator and beyond, where the foot goes on as a cylinder."""
    soil = SOILS[name]
    assert soil.force(depth, R) == pytest.approx(by_quadrature(soil, depth, R), rel=1e-7)


@pytest.mark.parametrize("name", SOILS)
def test_law_has_force_and_slope_of_the_soil_at_the_load(name: str) -> None:
    """The slope against central differences of the quadrature: 1e-5 is its noise."""
    soil, load, radius = SOILS[name], 8.0, 0.03
    law = hp.contact.HuntCrossley.soil(soil, radius=radius, load=load)
    depth = soil.sinkage(load, radius)
    assert by_quadrature(soil, depth, radius) == pytest.approx(load, rel=1e-7)
    force, slope, _, _ = law.native()(depth, 0.0, 0.0)
    h = 1e-3 * depth
    rise = by_quadrature(soil, depth + h, radius) - by_quadrature(soil, depth - h, radius)
    assert force == pytest.approx(load, rel=1e-10)
    assert slope == pytest.approx(rise / (2 * h), rel=1e-5)


def test_small_depths_are_an_exact_power_law() -> None:
    """K = 2 pi k R/(n + 1), m = n + 1; also the limit of small loads."""
    law = hp.contact.HuntCrossley.soil(SAND, radius=R)
    assert law.exponent == pytest.approx(2.1)
    assert law.stiffness == pytest.approx(2 * math.pi * 1.5e6 * R / 2.1, rel=1e-12)
    assert float(law.force(1e-6)) == pytest.approx(SAND.force(1e-6, R), rel=1e-4)
    stiffness, exponent = SAND.power_law(R, 1e-9)
    assert exponent == pytest.approx(2.1, abs=1e-3)
    assert stiffness == pytest.approx(law.stiffness, rel=1e-2)


def test_foot_sinks_by_the_soils_law_and_hardly_rebounds() -> None:
    """A robot at rest: each foot as deep as its own load requires, within 2 %."""
    robot = hp.load_robot("kharagpur")
    load = robot.total_mass * 9.80665 / 6.0
    contact = hp.Contact.soil("sand", radius=R, load=load)
    trace = hp.simulate(hp.Scene(robot, contact=contact), hp.HoldPosture(), duration=3.0)
    normal = trace.foot_force[-1, :, 2]
    assert normal.sum() == pytest.approx(6.0 * load, rel=1e-3)
    sunk = [SOILS["sand"].sinkage(float(force), R) for force in normal]
    assert -trace.foot_gap[-1] == pytest.approx(np.array(sunk), rel=0.02)
    assert delivered_restitution(1.5 * contact.normal.dissipation * 0.1) < 0.08
    assert contact.friction.mu == pytest.approx(math.tan(math.radians(31.1)))


def test_preset_is_named_and_lists_what_is_assumed() -> None:
    assert hp.Contact.preset("soil") == hp.Contact.soil()
    for name in SOILS:
        assert "dissipation" in hp.Contact.soil(name).assumed and SOILS[name].source
    speeds = np.array([-0.0066, -0.0067, -1.0])
    force = hp.Contact.soil().normal.force(1e-3, speeds)
    assert force[0] > 0.0 and not force[1:].any()  # it lets go at 1/(1.5 a) = 6.67 mm/s


def test_what_has_no_law_is_refused() -> None:
    with refused(UnknownNameError, kind="soil", name="peat"):
        hp.Contact.soil("peat")
    with refused(ParameterError, "load", None):
        hp.contact.HuntCrossley.soil(SOILS["clay"], radius=R)
    with refused(ParameterError, "load", 30.0):
        hp.Contact.soil("clay", radius=0.005, load=30.0)
    with refused(ParameterError, "radius", 0.0, allowed=(1e-6, 1e3)):
        hp.Contact.soil(radius=0.0)
