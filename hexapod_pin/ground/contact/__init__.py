"""Contact laws of a spherical foot on the ground: normal force, friction, and pairs of them."""

from hexapod_pin.ground.contact.contact import Contact
from hexapod_pin.ground.contact.friction import (
    AdamsCoulomb,
    BrownMcPhee,
    FrictionLaw,
    SmoothStep,
    StickSlip,
    TanhCoulomb,
)
from hexapod_pin.ground.contact.normal import (
    AdamsImpact,
    HuntCrossley,
    KelvinVoigt,
    NormalLaw,
    hertz_stiffness,
    stiffness_from_mm,
)
from hexapod_pin.ground.contact.restitution import (
    Restitution,
    delivered_restitution,
    exact_damping_ratio,
)
from hexapod_pin.ground.contact.soil import SOILS, Soil

__all__ = [
    "AdamsCoulomb",
    "AdamsImpact",
    "BrownMcPhee",
    "Contact",
    "FrictionLaw",
    "HuntCrossley",
    "KelvinVoigt",
    "NormalLaw",
    "Restitution",
    "SOILS",
    "SmoothStep",
    "Soil",
    "StickSlip",
    "TanhCoulomb",
    "delivered_restitution",
    "exact_damping_ratio",
    "hertz_stiffness",
    "stiffness_from_mm",
]
