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
from random_scenes.dice import Dice

DEFAULT_SHARE, PRESET_SHARE = 0.35, 0.2


def _hunt_crossley(dice: Dice) -> NormalLaw:
    exponent = dice.pick((1.0, 1.5, 2.2))
    stiffness = dice.log_between(3e4, 3e6) * 1e3 ** (exponent - 1.5)
    return HuntCrossley(
        stiffness=stiffness, exponent=exponent, dissipation=dice.log_between(0.1, 20.0)
    )


def _restitution(dice: Dice) -> NormalLaw:
    model: Any = dice.pick(tuple(DAMPING_RATIO))
    e = dice.between(0.1, 0.95)
    return Restitution(stiffness=dice.log_between(1e5, 3e6), restitution=e, model=model)


def _kelvin_voigt(dice: Dice) -> NormalLaw:
    return KelvinVoigt(stiffness=dice.log_between(3e3, 1e5), damping=dice.log_between(3.0, 100.0))


def _adams_impact(dice: Dice) -> NormalLaw:
    return AdamsImpact.from_mm(
        stiffness=dice.log_between(1e4, 1e5), exponent=dice.pick((1.5, 2.2)),
        damping=dice.log_between(0.1, 10.0), damping_depth=dice.log_between(0.03, 0.3),
    )  # fmt: skip


def _soil(dice: Dice) -> NormalLaw:
    return HuntCrossley.soil(soil_named(dice.pick(tuple(SOILS))), radius=0.02, load=10.0)


NORMAL_LAWS: Mapping[str, Callable[[Dice], NormalLaw]] = {
    "hunt-crossley": _hunt_crossley,
    "restitution": _restitution,
    "kelvin-voigt": _kelvin_voigt,
    "adams-impact": _adams_impact,
    "soil": _soil,
}


def _stick_slip(dice: Dice) -> FrictionLaw:
    return StickSlip(
        mu=dice.between(0.2, 1.0), stiffness=dice.log_between(3e3, 5e4),
        damping=dice.log_between(10.0, 100.0),
    )  # fmt: skip


def _falling_stick_slip(dice: Dice) -> FrictionLaw:
    mu = dice.between(0.3, 1.0)
    return StickSlip(
        mu=mu, mu_dynamic=mu * dice.between(0.4, 0.95), stiffness=dice.log_between(3e3, 5e4),
        damping=dice.log_between(10.0, 100.0),
    )  # fmt: skip


def _tanh(dice: Dice) -> FrictionLaw:
    return TanhCoulomb(mu=dice.between(0.2, 1.0), slope=dice.log_between(50.0, 3e3))


def _coefficients(dice: Dice) -> dict[str, Any]:
    mu = dice.between(0.2, 1.0)
    return {"mu_static": mu, "mu_dynamic": mu * dice.between(0.4, 1.0)}


def _smooth_step(dice: Dice) -> FrictionLaw:
    return SmoothStep(**_coefficients(dice), speed=dice.log_between(1e-3, 5e-2))


def _brown_mcphee(dice: Dice) -> FrictionLaw:
    return BrownMcPhee(**_coefficients(dice), speed=dice.log_between(1e-3, 5e-2))


def _adams_coulomb(dice: Dice) -> FrictionLaw:
    stiction = dice.log_between(2e-3, 0.1)
    transition = stiction * dice.between(1.5, 10.0)
    return AdamsCoulomb(**_coefficients(dice), stiction_speed=stiction, transition_speed=transition)


FALLING_STICK_SLIP = "stick-slip, mu_dynamic below mu"
FRICTION_LAWS: Mapping[str, Callable[[Dice], FrictionLaw]] = {
    "stick-slip": _stick_slip,
    FALLING_STICK_SLIP: _falling_stick_slip,
    "tanh-coulomb": _tanh,
    "smooth-step": _smooth_step,
    "brown-mcphee": _brown_mcphee,
    "adams-coulomb": _adams_coulomb,
}


def draw_contact(dice: Dice) -> tuple[Contact, str, str]:
    """Return a contact with the labels of its normal and friction law."""
    share = dice.between(0.0, 1.0)
    if share < DEFAULT_SHARE:
        return Contact.accurate(), "default", "default"
    if share < DEFAULT_SHARE + PRESET_SHARE:
        name = dice.pick([name for name in PRESETS if name != "accurate"])
        return Contact.preset(name), name, name
    normal, friction = dice.pick(tuple(NORMAL_LAWS)), dice.pick(tuple(FRICTION_LAWS))
    laws = {"normal": NORMAL_LAWS[normal](dice), "friction": FRICTION_LAWS[friction](dice)}
    return Contact.model_validate(laws), normal, friction
