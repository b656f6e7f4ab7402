"""Requested and delivered restitution: closed form, exact root, published values, free impacts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from refusals import refused
from scipy.special import lambertw
from vehicles import HARD_CASES

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact import delivered_restitution, exact_damping_ratio
from hexapod_pin.ground.contact.restitution import DAMPING_RATIO, bounce

HC01 = HARD_CASES["HC01_restitution_map"]["e_actual_vs_nominal"]
PHYSICS = {  # physics 3.2, four digits, for 0.10 0.20 0.30 0.50 0.70 0.80 0.90 0.95
    "hunt-crossley": ".5158 .5469 .5813 .6630 .7680 .8329 .9090 .9524",
    "herbert-mcwhannell": ".4907 .5008 .5200 .5936 .7227 .8070 .9009 .9501",
    "lee-wang": ".6867 .7120 .7390 .7992 .8693 .9090 .9524 .9756",
    "lankarani-nikravesh": ".6653 .6723 .6842 .7252 .7960 .8471 .9132 .9535",
    "gonthier": ".1010 .2046 .3042 .4877 .6696 .7680 .8764 .9359",
    "zhiying-qishao": ".2175 .2664 .3267 .4826 .6796 .7874 .8959 .9489",
    "flores": ".0694 .1555 .2562 .4704 .6832 .7885 .8939 .9468",
    "hu-guo": ".0741 .1656 .2707 .4877 .6973 .7992 .8999 .9500",
    "exact": ".1000 .2000 .3000 .5000 .7000 .8000 .9000 .9500",
}
REQUESTED = (0.10, 0.20, 0.30, 0.50, 0.70, 0.80, 0.90, 0.95)


@pytest.mark.parametrize(
    ("key", "nominal"), [(key, nominal) for key, values in HC01.items() for nominal in values]
)
def test_hc01_delivered_restitution(key: str, nominal: str) -> None:
    """HC01: every law and nominal value of the catalogue, from the closed form, to 1e-8."""
    model = key.rsplit("_", 1)[0].replace("_", "-")
    law = hp.contact.Restitution(stiffness=1e6, restitution=float(nominal), model=model)
    assert law.delivered == pytest.approx(float(HC01[key][nominal]), rel=1e-8)


@pytest.mark.parametrize("model", PHYSICS)
def test_table_of_the_physics_notes(model: str) -> None:
    printed = [float(text) for text in PHYSICS[model].split()]
    found = [delivered_restitution(DAMPING_RATIO[model](e)) for e in REQUESTED]
    assert found == pytest.approx(printed, abs=5.1e-5)  # the last printed digit


def test_exact_damping_ratios_of_the_physics_notes() -> None:
    printed = [9.998, 4.919, 3.087, 1.4328, 0.6348, 0.3731, 0.1665, 0.0789]
    assert [exact_damping_ratio(e) for e in REQUESTED] == pytest.approx(printed, abs=6e-4)


@pytest.mark.parametrize("eta", [0.05, 0.3, 1.0, 3.0, 10.0, 30.0, 300.0])
def test_closed_form_is_lamberts(eta: float) -> None:
    """Where the printed formula keeps its digits, it gives the same."""
    u = 1.0 + eta
    lambert = (1.0 + lambertw(-u * math.exp(-u)).real) / eta
    assert delivered_restitution(eta) == pytest.approx(lambert, rel=1e-12)  # eps/eta^2 of lambertw


@pytest.mark.parametrize("eta", [0.0, 5e-324, 1e-17, 1e-12, 1e-9, 1.1e-8, 1e-6, 1e-4])
def test_small_damping_follows_the_series(eta: float) -> None:
    """1 - 2/3 eta + 4/9 eta^2 - 44/135 eta^3 + O(eta^4), where Lambert's form loses digits."""
    series = 1.0 - eta * (2.0 / 3.0 - eta * (4.0 / 9.0 - eta * 44.0 / 135.0))
    assert delivered_restitution(eta) == pytest.approx(series, abs=4e-16)


@pytest.mark.parametrize("eta", [50.0, 1e3, 1e9, 1e300])
def test_large_damping_leaves_at_its_least_speed(eta: float) -> None:
    """Restitution tends to 1/eta: the exit speed is where damping cancels the spring."""
    assert delivered_restitution(eta) == pytest.approx(1.0 / eta, rel=1e-15)


def test_delivered_restitution_falls_with_damping() -> None:
    found = [delivered_restitution(float(eta)) for eta in np.geomspace(1e-12, 1e6, 2000)]
    # neighbours below 1e-10 differ by less than one rounding
    assert (np.diff(found) <= 0.0).all()


@pytest.mark.parametrize("e", [1e-300, 1e-9, 0.01, 0.3, 0.5, 0.99, 1 - 1e-6, 1 - 1e-12, 1 - 2e-16])
def test_exact_root_delivers_the_requested_restitution(e: float) -> None:
    eta = exact_damping_ratio(e)
    assert delivered_restitution(eta) == pytest.approx(e, rel=1e-15)
    if 0.01 < e < 0.99:  # the implicit relation itself, where it is well conditioned
        residual = math.log((1.0 + eta) / (1.0 - eta * e)) - eta * (1.0 + e)
        assert abs(residual) < 1e-13 * eta * (1.0 + e) / (1.0 - eta * e)


def test_elastic_and_dead() -> None:
    """Restitution 1 needs no damping; 0 would need infinitely much, and is refused."""
    assert exact_damping_ratio(1.0) == 0.0
    assert hp.contact.Restitution(stiffness=1e6, restitution=1.0).delivered == 1.0
    for wrong, bound in ((-0.1, 0.0), (1.1, 1.0)):
        with refused(ParameterError, "Restitution.restitution", wrong, allowed=(bound,)):
            hp.contact.Restitution(stiffness=1e6, restitution=wrong)
    with refused(
        ParameterError, "Restitution.restitution", 0.0, allowed=(0.0, 1.0), about=("0.01",)
    ):
        hp.contact.Restitution(stiffness=1e6, restitution=0.0)
    for wrong in (0.0, 1.0000001):
        with refused(ParameterError, "restitution", wrong, allowed=(0.0, 1.0), about=("0.01",)):
            exact_damping_ratio(wrong)
    with refused(ParameterError, "exact_damping_ratio.restitution", math.nan):
        exact_damping_ratio(math.nan)
    with refused(ParameterError, "eta", -1e-9):
        delivered_restitution(-1e-9)
    for wrong in (math.inf, math.nan):
        with refused(ParameterError, "delivered_restitution.eta", wrong):
            delivered_restitution(wrong)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
@pytest.mark.parametrize("model", DAMPING_RATIO)
def test_free_impact_delivers_the_closed_form(model: str, exponent: float) -> None:
    """An integrated impact, with another solver, whatever exponent, stiffness, mass and speed."""
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


@pytest.mark.parametrize(("mass", "speed"), [(0.0, 0.1), (0.1, -1.0), (math.nan, 0.1)])
def test_free_impact_needs_mass_and_speed(mass: float, speed: float) -> None:
    name, value = ("speed", speed) if mass > 0.0 else ("mass", mass)
    with refused(ParameterError, name, value, allowed=(1e-9, 1e9)):
        bounce(hp.Contact.s1().normal, mass=mass, speed=speed)
