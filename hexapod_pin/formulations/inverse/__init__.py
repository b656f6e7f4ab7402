"""S2's torques of a given motion: inverse dynamics with foot forces, and how feet share the load.

The balance is that of S2 appendix eqs. 1-2, solved for the torques; where the six equations of the
base leave the foot forces open, a split chooses them.
"""

from hexapod_pin.formulations.inverse.dynamics import (
    InverseDynamics,
    PrescribedGait,
    inverse_dynamics,
    prescribed_gait,
    torque_under_forces,
)
from hexapod_pin.formulations.inverse.force_split import (
    Compliant,
    ForceSplit,
    InfeasibleError,
    LeastTorque,
    MinimumNorm,
    normal_force_margin,
    pyramid,
    tipping_slope,
)
from hexapod_pin.formulations.inverse.stance import (
    ContactSprings,
    NoRestError,
    StanceLoad,
    stance_load,
)

__all__ = [
    "Compliant",
    "ContactSprings",
    "ForceSplit",
    "InfeasibleError",
    "InverseDynamics",
    "LeastTorque",
    "MinimumNorm",
    "NoRestError",
    "PrescribedGait",
    "StanceLoad",
    "inverse_dynamics",
    "normal_force_margin",
    "prescribed_gait",
    "pyramid",
    "stance_load",
    "tipping_slope",
    "torque_under_forces",
]
