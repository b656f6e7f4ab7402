"""S1's own equations: rigid bodies in maximal coordinates, joints as constraints with multipliers.

Every body has a position, a unit quaternion and six velocities; every revolute joint takes five
of them away (S1 eqs 1-3). Nothing here knows Pinocchio or reduced coordinates: it is the
independent path that the core is compared with, and it gives the reaction of every joint.
"""

from hexapod_pin.formulations.maximal.bodies import Bodies, read_bodies
from hexapod_pin.formulations.maximal.derivative import (
    JointReaction,
    MaximalDerivative,
    derivative,
    energy,
    joint_reactions,
)
from hexapod_pin.formulations.maximal.ground_contact import GroundContact
from hexapod_pin.formulations.maximal.model import MaximalModel, initial_state
from hexapod_pin.formulations.maximal.model_parts import Baumgarte, JointActuators, RootConstraint
from hexapod_pin.formulations.maximal.run import (
    MaximalRun,
    integrate,
    project,
    reduced_acceleration,
)
from hexapod_pin.formulations.maximal.state import MaximalState

__all__ = [
    "Baumgarte",
    "Bodies",
    "GroundContact",
    "JointActuators",
    "JointReaction",
    "MaximalDerivative",
    "MaximalModel",
    "MaximalRun",
    "MaximalState",
    "RootConstraint",
    "derivative",
    "energy",
    "initial_state",
    "integrate",
    "joint_reactions",
    "project",
    "read_bodies",
    "reduced_acceleration",
]
