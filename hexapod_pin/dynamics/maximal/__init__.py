"""S1's own equations: rigid bodies in maximal coordinates, joints as constraints with multipliers.

Every body has a position, a unit quaternion and six velocities; every revolute joint takes five
of them away (S1 eqs 1-3). Nothing here knows Pinocchio or reduced coordinates: it is the
independent path that the core is compared with, and it gives the reaction of every joint.
"""

from hexapod_pin.dynamics.maximal.baumgarte import Baumgarte as Baumgarte
from hexapod_pin.dynamics.maximal.bodies import Bodies as Bodies
from hexapod_pin.dynamics.maximal.drives import Drives as Drives
from hexapod_pin.dynamics.maximal.evaluation import Evaluation as Evaluation
from hexapod_pin.dynamics.maximal.foot_ground import FootGround as FootGround
from hexapod_pin.dynamics.maximal.invariants import Invariants as Invariants
from hexapod_pin.dynamics.maximal.invariants import invariants as invariants
from hexapod_pin.dynamics.maximal.model import MaximalModel as MaximalModel
from hexapod_pin.dynamics.maximal.motion import BodyState as BodyState
from hexapod_pin.dynamics.maximal.mount import Mount as Mount
from hexapod_pin.dynamics.maximal.projection import project as project
from hexapod_pin.dynamics.maximal.reactions import JointReaction as JointReaction
from hexapod_pin.dynamics.maximal.reactions import joint_reactions as joint_reactions
from hexapod_pin.dynamics.maximal.run import Run as Run
from hexapod_pin.dynamics.maximal.run import integrate as integrate
from hexapod_pin.dynamics.maximal.urdf_bodies import read_bodies as read_bodies
