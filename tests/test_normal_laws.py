"""Normal laws: native formulas and derivatives against NumPy, energy, units, no pull."""

from __future__ import annotations

import math

import numpy as np
import pytest
from contact_formulas import NORMAL, numpy_normal
from refusals import refused
from scipy.integrate import quad

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.ground.contact import (
    SOILS,
    Soil,
    hertz_stiffness,
    stiffness_from_mm,
)

TOUCH = 0.1


def random_states(count: int = 200) -> list[tuple[float, float]]:
    rng = np.random.default_rng(1)
    return list(zip(rng.uniform(-1e-4, 5e-4, count), rng.uniform(-0.3, 0.3, count), strict=True))


@pytest.mark.parametrize("name", NORMAL)
def test_force_equals_its_formula(name: str) -> None:
    law = NORMAL[name]
    for depth, rate in [*random_states(), (1e-4, -10.0), (-1e-4, 10.0)]:  # the last two pull
        expected = numpy_normal(law, depth, rate, TOUCH)
        # one rounding per operation, about ten; the sum of spring and damper may cancel
        scale = abs(law.native()(max(depth, 0.0), 0.0, TOUCH)[0])
        found = law.force(depth, rate, TOUCH)
        assert found == pytest.approx(expected, rel=1e-14, abs=1e-14 * scale)


@pytest.mark.parametrize("name", NORMAL)
def test_derivatives_equal_complex_steps(name: str) -> None:
    """At random states, at rest, at first touch (depth 0+), and where the law is clamped to 0."""
    law, native = NORMAL[name], NORMAL[name].native()
    chosen = [(3e-4, 0.0), (1e-12, 0.1), (1e-12, 0.0), (1e-100, 0.1), (1e-4, -10.0), (-1e-4, 0.1)]
    for depth, rate in [*random_states(), *chosen]:
        step = 1e-20 * abs(depth)
        by_depth = np.imag(numpy_normal(law, depth + 1j * step, rate + 0j, TOUCH)) / step
        by_rate = np.imag(numpy_normal(law, depth + 0j, rate + 1e-20j, TOUCH)) / 1e-20
        _, d_depth, d_rate, _ = native(depth, rate, TOUCH)
        # two terms of ADAMS' slope may cancel to 1e-3 of themselves
        assert d_depth == pytest.approx(by_depth, rel=1e-11, abs=1e-300), (depth, rate)
        assert d_rate == pytest.approx(by_rate, rel=1e-12, abs=1e-300), (depth, rate)


@pytest.mark.parametrize("name", NORMAL)
def test_hc33_derivatives_at_denormal_depth(name: str) -> None:
    """HC33: at 1e-310 they are those of the limit, n K d^(n-1) and the damping there."""
    law = NORMAL[name]
    assert 0.0 <= float(law.force(1e-310, 1e-310, 1e-310)) < 1e-300
    assert np.all(np.isfinite(law.native()(5e-324, 0.0, 0.0)))
    assert law.native()(0.0, 1.0, 1.0)[0] == 0.0
    _, d_depth, d_rate, _ = law.native()(1e-310, 1e-3, TOUCH)
    slope = 0.0
    if law.exponent == 1.0:
        slope = law.stiffness * (1.0 + 1.5e-3 * getattr(law, "dissipation", 0.0))
    assert d_depth == pytest.approx(slope, rel=1e-13, abs=1e-140)
    at_touch = law.damping if isinstance(law, hp.contact.KelvinVoigt) else 0.0
    assert d_rate == pytest.approx(at_touch, abs=1e-140)


@pytest.mark.parametrize("name", NORMAL)
def test_energy_is_the_integral_of_the_elastic_force_and_damping_gives_none(name: str) -> None:
    native = NORMAL[name].native()
    depth = np.linspace(0.0, 3e-4, 20001)
    force = np.array([native(d, 0.0)[3] for d in depth])
    assert native.energy(depth[-1]) == pytest.approx(np.trapezoid(force, depth), rel=1e-7)
    for d, rate in random_states():
        total, _, _, elastic = native(d, rate, TOUCH)
        assert (total - elastic) * rate >= 0.0


def test_touch_speed_has_a_floor() -> None:
    law = hp.contact.Restitution(stiffness=1e6, restitution=0.3, speed_floor=2e-3)
    floor = float(law.force(1e-4, 1e-3, 2e-3))
    assert float(law.force(1e-4, 1e-3, 0.0)) == floor
    assert float(law.force(1e-4, 1e-3, 4e-3)) < floor


def test_units_of_the_second_paper() -> None:
    """1e5 N/mm^2.2 is 3.981e11 N/m^2.2; 5.05, 7.57, 10.1 N sink as in physics 3.3 (4 digits)."""
    assert stiffness_from_mm(1e5, 2.2) == pytest.approx(3.98107170553497e11, rel=1e-12)
    for depth, force in [(0.01114e-3, 5.05), (0.01339e-3, 7.57), (0.01527e-3, 10.1)]:
        assert float(NORMAL["adams"].force(depth)) == pytest.approx(force, rel=2e-3)


def test_hertz_stiffness_of_the_assumed_rubber_foot() -> None:
    """E 5 MPa, nu 0.49, R 20 mm: 1.24e6 N/m^1.5; 13.5 N sink it by 0.49 mm."""
    rubber = {"young": 5e6, "poisson": 0.49, "radius": 0.02}
    assert hertz_stiffness(**rubber) == pytest.approx(1.24e6, rel=2e-3)
    assert float(NORMAL["hertz"].force(0.49e-3)) == pytest.approx(13.5, rel=1e-2)
    assert hp.contact.Restitution.hertz(**rubber, restitution=0.3) == hp.Contact.accurate().normal
    assert hp.contact.HuntCrossley.hertz(**rubber, dissipation=20.0) == hp.Contact.s1().normal
    with refused(ParameterError, "young", 0.0):
        hertz_stiffness(**{**rubber, "young": 0.0})
    with refused(ParameterError, "poisson", 0.6):
        hertz_stiffness(**{**rubber, "poisson": 0.6})


# soil under a spherical foot: Bekker's pressure over the cap, and the law next to it

R = 0.02
SAND = Soil(exponent=1.1, frictional_modulus=1.5e6, friction_angle=0.5)


def by_quadrature(soil: Soil, depth: float, radius: float) -> float:
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


def test_soils_as_contacts() -> None:
    assert hp.Contact.preset("soil") == hp.Contact.soil()
    for name in SOILS:
        assert "dissipation" in hp.Contact.soil(name).assumed and SOILS[name].source
    speeds = np.array([-0.0066, -0.0067, -1.0])
    force = hp.Contact.soil().normal.force(1e-3, speeds)
    assert force[0] > 0.0 and not force[1:].any()  # it lets go at 1/(1.5 a) = 6.67 mm/s
    assert hp.Contact.soil("sand").friction.mu == pytest.approx(math.tan(math.radians(31.1)))
    with refused(UnknownNameError, kind="soil", name="peat"):
        hp.Contact.soil("peat")
    with refused(ParameterError, "load", None):
        hp.contact.HuntCrossley.soil(SOILS["clay"], radius=R)
    with refused(ParameterError, "load", 30.0):
        hp.Contact.soil("clay", radius=0.005, load=30.0)
    with refused(ParameterError, "radius", 0.0, allowed=(1e-6, 1e3)):
        hp.Contact.soil(radius=0.0)
