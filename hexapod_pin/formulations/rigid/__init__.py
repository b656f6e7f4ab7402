"""S2's appendix: feet that stick to rigid ground (eqs. 1-4) and plastic impact (eq. 5).

Coordinates are the robot's: base pose and joint angles. Mass matrix, bias and contact rows come
from Pinocchio; nothing is shared with the native core.
"""

from hexapod_pin.formulations.rigid.contact_events import (
    PlasticImpact,
    TouchDownImpact,
    plastic_impact,
    unilateral_impact,
)
from hexapod_pin.formulations.rigid.derivative import (
    ContactSet,
    RigidDerivative,
    StickingCheck,
    derivative,
    prescribed_derivative,
)
from hexapod_pin.formulations.rigid.model import (
    RigidGround,
    RigidModel,
    energy,
    initial_state,
    standing_state,
)
from hexapod_pin.formulations.rigid.run import FrictionDemand, RigidRun, integrate, simulate

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
