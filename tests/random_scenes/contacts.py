"""Contacts drawn at random: presets, the default most often, and every pair of laws.

Ranges are *assumed*: feet of 0.1 kg under 1 to 50 N, from soft rubber (0.1 ms to 10 ms of contact)
to slopes of the friction laws at which an explicit method still ends.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hexapod_pin.ground.contact import (
    AdamsCoulomb,
    AdamsImpact,
    BrownMcPhee,
    Contact,
    FrictionLaw,
    HuntCrossley,
    KelvinVoigt,
    NormalLaw,
    Restitution,
    SmoothStep,
    StickSlip,
    TanhCoulomb,
)
from hexapod_pin.ground.contact.contact import PRESETS
from hexapod_pin.ground.contact.restitution import DAMPING_RATIO
from hexapod_pin.ground.contact.soil import SOILS, soil_named
from random_scenes.draws import Draws

DEFAULT_SHARE, PRESET_SHARE = 0.35, 0.2


def _hunt_crossley(rng: Draws) -> NormalLaw:
    exponent = rng.pick((1.0, 1.5, 2.2))
    stiffness = rng.log_between(3e4, 3e6) * 1e3 ** (exponent - 1.5)
    return HuntCrossley(
        stiffness=stiffness, exponent=exponent, dissipation=rng.log_between(0.1, 20.0)
    )


def _restitution(rng: Draws) -> NormalLaw:
    model: Any = rng.pick(tuple(DAMPING_RATIO))
    e = rng.between(0.1, 0.95)
    return Restitution(stiffness=rng.log_between(1e5, 3e6), restitution=e, model=model)


def _kelvin_voigt(rng: Draws) -> NormalLaw:
    return KelvinVoigt(stiffness=rng.log_between(3e3, 1e5), damping=rng.log_between(3.0, 100.0))


def _adams_impact(rng: Draws) -> NormalLaw:
    return AdamsImpact.from_mm(
        stiffness=rng.log_between(1e4, 1e5), exponent=rng.pick((1.5, 2.2)),
        damping=rng.log_between(0.1, 10.0), damping_depth=rng.log_between(0.03, 0.3),
    )  # fmt: skip


def _soil(rng: Draws) -> NormalLaw:
    return HuntCrossley.soil(soil_named(rng.pick(tuple(SOILS))), radius=0.02, load=10.0)


NORMAL_LAWS: Mapping[str, Callable[[Draws], NormalLaw]] = {
    "hunt-crossley": _hunt_crossley,
    "restitution": _restitution,
    "kelvin-voigt": _kelvin_voigt,
    "adams-impact": _adams_impact,
    "soil": _soil,
}


def _stick_slip(rng: Draws) -> FrictionLaw:
    return StickSlip(
        mu=rng.between(0.2, 1.0), stiffness=rng.log_between(3e3, 5e4),
        damping=rng.log_between(10.0, 100.0),
    )  # fmt: skip


def _falling_stick_slip(rng: Draws) -> FrictionLaw:
    mu = rng.between(0.3, 1.0)
    return StickSlip(
        mu=mu, mu_dynamic=mu * rng.between(0.4, 0.95), stiffness=rng.log_between(3e3, 5e4),
        damping=rng.log_between(10.0, 100.0),
    )  # fmt: skip


def _tanh(rng: Draws) -> FrictionLaw:
    return TanhCoulomb(mu=rng.between(0.2, 1.0), slope=rng.log_between(50.0, 3e3))


def _coefficients(rng: Draws) -> dict[str, Any]:
    mu = rng.between(0.2, 1.0)
    return {"mu_static": mu, "mu_dynamic": mu * rng.between(0.4, 1.0)}


def _smooth_step(rng: Draws) -> FrictionLaw:
    return SmoothStep(**_coefficients(rng), speed=rng.log_between(1e-3, 5e-2))


def _brown_mcphee(rng: Draws) -> FrictionLaw:
    return BrownMcPhee(**_coefficients(rng), speed=rng.log_between(1e-3, 5e-2))


def _adams_coulomb(rng: Draws) -> FrictionLaw:
    stiction = rng.log_between(2e-3, 0.1)
    transition = stiction * rng.between(1.5, 10.0)
    return AdamsCoulomb(**_coefficients(rng), stiction_speed=stiction, transition_speed=transition)


FALLING_STICK_SLIP = "stick-slip, mu_dynamic below mu"
FRICTION_LAWS: Mapping[str, Callable[[Draws], FrictionLaw]] = {
    "stick-slip": _stick_slip,
    FALLING_STICK_SLIP: _falling_stick_slip,
    "tanh-coulomb": _tanh,
    "smooth-step": _smooth_step,
    "brown-mcphee": _brown_mcphee,
    "adams-coulomb": _adams_coulomb,
}


def draw_contact(rng: Draws) -> tuple[Contact, str, str]:
    """Return a contact with the labels of its normal and friction law."""
    share = rng.between(0.0, 1.0)
    if share < DEFAULT_SHARE:
        return Contact.accurate(), "default", "default"
    if share < DEFAULT_SHARE + PRESET_SHARE:
        name = rng.pick([name for name in PRESETS if name != "accurate"])
        return Contact.preset(name), name, name
    normal, friction = rng.pick(tuple(NORMAL_LAWS)), rng.pick(tuple(FRICTION_LAWS))
    laws = {"normal": NORMAL_LAWS[normal](rng), "friction": FRICTION_LAWS[friction](rng)}
    return Contact.model_validate(laws), normal, friction
