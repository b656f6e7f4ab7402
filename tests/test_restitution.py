"""Requested and delivered restitution: closed form, exact root, published values, free impacts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracles.second_rhs.normal_force import restitution_damping
from refusals import refused
from scipy.special import lambertw
from vehicles import HARD_CASES

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact import delivered_restitution, exact_damping_ratio
from hexapod_pin.ground.contact.restitution import DAMPING_RATIO, bounce

HC01 = HARD_CASES["HC01_restitution_map"]["e_actual_vs_nominal"]


@pytest.mark.parametrize("key", HC01)
def test_hc01_delivered_restitution(key: str) -> None:
    model = key.rsplit("_", 1)[0].replace("_", "-")
    for nominal, known in HC01[key].items():
        law = hp.contact.Restitution(stiffness=1e6, restitution=float(nominal), model=model)
        assert law.delivered == pytest.approx(float(known), rel=1e-8)


@pytest.mark.parametrize("model", DAMPING_RATIO)
def test_damping_is_that_of_a_second_writing(model: str) -> None:
    for e in (0.1, 0.3, 0.5, 0.8, 0.95):
        assert DAMPING_RATIO[model](e) == pytest.approx(restitution_damping(model, e), rel=1e-12)


def test_closed_form_and_its_ends() -> None:
    """Lambert's; for little damping the series, where that loses digits; for much 1/eta."""
    for eta in (0.0, 5e-324, 1e-12, 1.1e-8, 1e-4):
        series = 1.0 - eta * (2.0 / 3.0 - eta * (4.0 / 9.0 - eta * 44.0 / 135.0))
        assert delivered_restitution(eta) == pytest.approx(series, abs=4e-16)
    for eta in (0.05, 1.0, 30.0):
        u = 1.0 + eta
        lambert = (1.0 + lambertw(-u * math.exp(-u)).real) / eta
        assert delivered_restitution(eta) == pytest.approx(lambert, rel=1e-12)
    for eta in (50.0, 1e300):
        assert delivered_restitution(eta) == pytest.approx(1.0 / eta, rel=1e-15)


@pytest.mark.parametrize("e", [1e-300, 1e-9, 0.3, 0.95, 1 - 1e-12, 1 - 2e-16])
def test_exact_root_delivers_the_requested_restitution(e: float) -> None:
    eta = exact_damping_ratio(e)
    assert delivered_restitution(eta) == pytest.approx(e, rel=1e-15)
    if 0.01 < e < 0.99:  # the implicit relation itself, where it is well conditioned
        residual = math.log((1.0 + eta) / (1.0 - eta * e)) - eta * (1.0 + e)
        assert abs(residual) < 1e-13 * eta * (1.0 + e) / (1.0 - eta * e)


def test_elastic_and_dead() -> None:
    assert exact_damping_ratio(1.0) == 0.0
    assert hp.contact.Restitution(stiffness=1e6, restitution=1.0).delivered == 1.0
    with refused(
        ParameterError, "Restitution.restitution", 0.0, allowed=(0.0, 1.0), about=("0.01",)
    ):
        hp.contact.Restitution(stiffness=1e6, restitution=0.0)
    with refused(ParameterError, "restitution", 1.0000001, allowed=(0.0, 1.0), about=("0.01",)):
        exact_damping_ratio(1.0000001)
    with refused(ParameterError, "eta", -1e-9):
        delivered_restitution(-1e-9)
    with refused(ParameterError, "delivered_restitution.eta", math.inf):
        delivered_restitution(math.inf)
    for mass, speed, name in ((math.nan, 0.1, "mass"), (0.1, -1.0, "speed")):
        with refused(ParameterError, name, allowed=(1e-9, 1e9)):
            bounce(hp.Contact.s1().normal, mass=mass, speed=speed)


@pytest.mark.parametrize("exponent", [1.0, 2.2])
@pytest.mark.parametrize("model", ["flores", "exact"])
def test_free_impact_delivers_the_closed_form(model: str, exponent: float) -> None:
    law = hp.contact.Restitution(stiffness=3e5, exponent=exponent, restitution=0.4, model=model)
    for mass, speed in [(0.11, 0.02), (3.0, 1.7)]:
        hit = bounce(law, mass=mass, speed=speed)
        assert hit.restitution == pytest.approx(law.delivered, rel=1e-8)  # LSODA at 1e-10


def test_free_impact_conserves_energy_and_momentum() -> None:
    """Elastic Hertz: depth (5 m v^2/4K)^0.4, duration 2.943 d/v; impulse of any law m v (1 + e)."""
    mass, speed, law = 0.15, 0.1, hp.contact.HuntCrossley(stiffness=1.24e6)
    hit = bounce(law, mass=mass, speed=speed)
    depth = (1.25 * mass * speed**2 / law.stiffness) ** 0.4
    assert hit.restitution == pytest.approx(1.0, rel=1e-8)
    assert hit.depth.max() == pytest.approx(depth, rel=1e-3)  # largest of the solver's own samples
    assert hit.time[-1] == pytest.approx(2.9432750 * depth / speed, rel=1e-6)
    damped = bounce(hp.Contact.s2().normal, mass=mass, speed=speed)
    impulse = np.trapezoid(damped.force, damped.time)
    assert impulse == pytest.approx(mass * speed * (1.0 + damped.restitution), rel=1e-3)
