"""Friction laws: native formulas and slopes against NumPy, creep speeds, limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from contact_formulas import FRICTION, numpy_friction
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError

SPEEDS = [1e-9, 1e-7, 1e-5, 1e-3, 0.0199, 0.0201, 0.03, 0.0599, 0.0601, 0.0999, 0.1001, 0.5, 1.5]
IMAGINARY = 1e-200
CREEPING = {
    **FRICTION,
    "no peak": hp.contact.BrownMcPhee(mu_static=0.4, mu_dynamic=0.4, speed=0.02),
    "rising": hp.contact.AdamsCoulomb(
        mu_static=0.2, mu_dynamic=0.5, stiction_speed=0.1, transition_speed=1.0
    ),
}


@pytest.mark.parametrize("name", FRICTION)
def test_slope_equals_a_complex_step(name: str) -> None:
    """And m(s) its formula; the native ratio + slope s^2 is dm/ds."""
    law, native, rng = FRICTION[name], FRICTION[name].native(), np.random.default_rng(3)
    for speed in [*SPEEDS, *rng.uniform(0.0, 0.3, 100), 2.0]:
        assert law.coefficient(speed) == pytest.approx(numpy_friction(law, speed), rel=1e-12)
        ratio, slope = native(speed)
        exact = np.imag(numpy_friction(law, speed + 1j * IMAGINARY)) / IMAGINARY
        # ratio and slope s^2 cancel where m is flat: absolute, on the scale of the ratio
        assert ratio + slope * speed * speed == pytest.approx(exact, rel=1e-11, abs=1e-12 * ratio)


@pytest.mark.parametrize("name", FRICTION)
def test_hc33_at_rest_and_at_denormal_speed(name: str) -> None:
    """HC33: at speed 0 and 1e-310 the ratio is the slope of m at rest; nothing is NaN."""
    law, native = FRICTION[name], FRICTION[name].native()
    at_rest = np.imag(numpy_friction(law, 0.0 + 1j * IMAGINARY)) / IMAGINARY
    for speed in (0.0, 5e-324, 1e-310):
        assert np.all(np.isfinite(native(speed)))
        assert native(speed)[0] == pytest.approx(at_rest, rel=1e-14, abs=1e-290)
        assert float(law.coefficient(speed)) < 1e-300
        assert law.creep_speed(speed) <= max(1e-300, law.limit * speed ** (1.0 / 3.0))


@pytest.mark.parametrize("name", CREEPING)
@pytest.mark.parametrize("share", [1e-9, 0.5, 0.999])
def test_friction_at_the_creep_speed_carries_the_load(name: str, share: float) -> None:
    """The creep speed is the first speed at which m(s) reaches the load."""
    law = CREEPING[name]
    load = share * law.limit
    speed = law.creep_speed(load)
    assert float(numpy_friction(law, speed)) == pytest.approx(load, rel=1e-12)
    slower = np.array([numpy_friction(law, s) for s in np.linspace(0.0, 0.999999 * speed, 200)])
    assert (slower < load).all()


@pytest.mark.parametrize("name", [*CREEPING, "stick-slip"])
def test_creep_ends_at_the_limit(name: str) -> None:
    law = CREEPING.get(name) or hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0)
    assert law.creep_speed(0.0) == 0.0
    assert math.isinf(law.creep_speed(law.limit * 1.0000001))
    with refused(ParameterError, "load_ratio", -0.1):
        law.creep_speed(-0.1)
    if name == "stick-slip":  # no creep below the limit; in slip the dynamic coefficient
        assert law.creep_speed(0.69999) == 0.0 and law.mu_dynamic == 0.7
        law = hp.contact.StickSlip(mu=0.7, mu_dynamic=0.5, stiffness=2e4, damping=60.0)
        assert law.coefficient([0.0, 1e-6, 1.0]).tolist() == [0.0, 0.5, 0.5]


def test_creep_speeds_of_the_physics_notes() -> None:
    """Physics 4: mm/s by the numbers of S2 at loads 0.01 to 0.2; mm in 5 s at r = 0.5, mu = 0.6."""
    law = hp.Contact.s2().friction
    creep = [1e3 * law.creep_speed(load) for load in (0.01, 0.05, 0.0875, 0.1, 0.2)]
    assert creep == pytest.approx([2.2, 11.2, 19.7, 22.6, 48.2], abs=0.05)  # one decimal printed
    for slope, drift in [(20, 137), (100, 27.5), (1000, 2.75), (5000, 0.55)]:
        law = hp.contact.TanhCoulomb(mu=0.6, slope=slope)
        assert 5e3 * law.creep_speed(0.3) == pytest.approx(drift, rel=5e-3)


@pytest.mark.parametrize("name", [*CREEPING, "stick-slip"])
def test_another_mu_keeps_the_ratio_of_the_two(name: str) -> None:
    bristle = {"stiffness": 2e4, "damping": 60.0}
    law = CREEPING.get(name) or hp.contact.StickSlip(mu=0.8, mu_dynamic=0.4, **bristle)
    static = "mu" if hasattr(law, "mu") else "mu_static"
    other = law.with_mu(0.35)
    assert getattr(other, static) == 0.35
    if hasattr(law, "mu_dynamic"):
        kept = law.mu_dynamic / getattr(law, static)
        assert other.mu_dynamic / 0.35 == pytest.approx(kept, rel=1e-14)
    rest = {"mu", "mu_static", "mu_dynamic"}
    assert other.model_dump(exclude=rest) == law.model_dump(exclude=rest)
    with refused(ParameterError, f"{type(law).__name__}.{static}", -0.1, allowed=(0,)):
        law.with_mu(-0.1)
