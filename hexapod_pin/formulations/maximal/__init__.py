"""S1's own equations: rigid bodies in maximal coordinates, joints as constraints with multipliers.

Every body has a position, a unit quaternion and six velocities; every revolute joint takes five
of them away (S1 eqs 1-3). Nothing here knows Pinocchio or reduced coordinates: it is the
independent path that the core is compared with, and it gives the reaction of every joint.
"""

from hexapod_pin.formulations.maximal.baumgarte import Baumgarte as Baumgarte
from hexapod_pin.formulations.maximal.bodies import Bodies as Bodies
from hexapod_pin.formulations.maximal.drives import Drives as Drives
from hexapod_pin.formulations.maximal.evaluation import Evaluation as Evaluation
from hexapod_pin.formulations.maximal.foot_ground import FootGround as FootGround
from hexapod_pin.formulations.maximal.invariants import Invariants as Invariants
from hexapod_pin.formulations.maximal.invariants import invariants as invariants
from hexapod_pin.formulations.maximal.model import MaximalModel as MaximalModel
from hexapod_pin.formulations.maximal.motion import BodyState as BodyState
from hexapod_pin.formulations.maximal.mount import Mount as Mount
from hexapod_pin.formulations.maximal.projection import project as project
from hexapod_pin.formulations.maximal.reactions import JointReaction as JointReaction
from hexapod_pin.formulations.maximal.reactions import joint_reactions as joint_reactions
from hexapod_pin.formulations.maximal.run import Run as Run
from hexapod_pin.formulations.maximal.run import integrate as integrate
from hexapod_pin.formulations.maximal.urdf_bodies import read_bodies as read_bodies
