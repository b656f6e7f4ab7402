"""Controllers: they plan a joint reference before a run."""

from hexapod_pin.control.hold_posture import HoldPosture as HoldPosture
from hexapod_pin.control.joint_trajectory import Controller as Controller
from hexapod_pin.control.joint_trajectory import JointTrajectory as JointTrajectory
from hexapod_pin.control.kinematic import KinematicControl as KinematicControl
from hexapod_pin.control.sampled_trajectory import SampledTrajectory as SampledTrajectory
