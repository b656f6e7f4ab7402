"""S2's appendix: feet that stick to rigid ground (eqs. 1-4) and plastic impact (eq. 5).

Coordinates are the robot's: base pose and joint angles. Mass matrix, bias and contact rows come
from Pinocchio; nothing is shared with the native core.
"""

from hexapod_pin.formulations.rigid.constraints import ContactSet
from hexapod_pin.formulations.rigid.contact_events import TouchDownImpact
from hexapod_pin.formulations.rigid.derivative import (
    RigidDerivative,
    derivative,
    prescribed_derivative,
)
from hexapod_pin.formulations.rigid.energy import energy
from hexapod_pin.formulations.rigid.ground import RigidGround
from hexapod_pin.formulations.rigid.impact import (
    PlasticImpact,
    plastic_impact,
    unilateral_impact,
)
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.rigid.run import RigidRun, integrate, simulate
from hexapod_pin.formulations.rigid.state import initial_state, standing_state
from hexapod_pin.formulations.rigid.sticking import StickingCheck
from hexapod_pin.formulations.rigid.trace import FrictionDemand

__all__ = [
    "ContactSet",
    "FrictionDemand",
    "PlasticImpact",
    "RigidDerivative",
    "RigidGround",
    "RigidModel",
    "RigidRun",
    "StickingCheck",
    "TouchDownImpact",
    "derivative",
    "energy",
    "initial_state",
    "integrate",
    "plastic_impact",
    "prescribed_derivative",
    "simulate",
    "standing_state",
    "unilateral_impact",
]
