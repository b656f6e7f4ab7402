"""Contact laws of a spherical foot on the ground: normal force, friction, and pairs of them."""

from hexapod_pin.ground.contact.friction_law import FrictionLaw as FrictionLaw
from hexapod_pin.ground.contact.normal import AdamsImpact as AdamsImpact
from hexapod_pin.ground.contact.normal import HuntCrossley as HuntCrossley
from hexapod_pin.ground.contact.normal import KelvinVoigt as KelvinVoigt
from hexapod_pin.ground.contact.normal import NormalLaw as NormalLaw
from hexapod_pin.ground.contact.normal import hertz_stiffness as hertz_stiffness
from hexapod_pin.ground.contact.normal import stiffness_from_mm as stiffness_from_mm
from hexapod_pin.ground.contact.pair import Contact as Contact
from hexapod_pin.ground.contact.regularised_friction import AdamsCoulomb as AdamsCoulomb
from hexapod_pin.ground.contact.regularised_friction import BrownMcPhee as BrownMcPhee
from hexapod_pin.ground.contact.regularised_friction import SmoothStep as SmoothStep
from hexapod_pin.ground.contact.regularised_friction import TanhCoulomb as TanhCoulomb
from hexapod_pin.ground.contact.restitution import Restitution as Restitution
from hexapod_pin.ground.contact.restitution import delivered_restitution as delivered_restitution
from hexapod_pin.ground.contact.restitution import exact_damping_ratio as exact_damping_ratio
from hexapod_pin.ground.contact.stick_slip import StickSlip as StickSlip
