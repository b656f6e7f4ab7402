"""S1's own equations: rigid bodies in maximal coordinates, joints as constraints with multipliers.

Every body has a position, a unit quaternion and six velocities; every revolute joint takes five
of them away (S1 eqs 1-3). Nothing here knows Pinocchio or reduced coordinates: it is the
independent path that the core is compared with, and it gives the reaction of every joint.
"""

from hexapod_pin.formulations.maximal.actuators import JointActuators
from hexapod_pin.formulations.maximal.baumgarte import Baumgarte
from hexapod_pin.formulations.maximal.bodies import Bodies
from hexapod_pin.formulations.maximal.derivative import MaximalDerivative, derivative
from hexapod_pin.formulations.maximal.energy import energy
from hexapod_pin.formulations.maximal.ground_contact import GroundContact
from hexapod_pin.formulations.maximal.model import MaximalModel
from hexapod_pin.formulations.maximal.projection import project
from hexapod_pin.formulations.maximal.reactions import JointReaction, joint_reactions
from hexapod_pin.formulations.maximal.reduced import reduced_acceleration
from hexapod_pin.formulations.maximal.root_constraint import RootConstraint
from hexapod_pin.formulations.maximal.run import MaximalRun, integrate
from hexapod_pin.formulations.maximal.state import MaximalState, initial_state
from hexapod_pin.formulations.maximal.urdf_bodies import read_bodies

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
