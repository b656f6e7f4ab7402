"""Controllers: gaits, foot paths, joint trajectories planned before a run."""

from hexapod_pin.control.feasible_gait import feasible_gait
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.hold_posture import HoldPosture
from hexapod_pin.control.joint_trajectory import Controller, JointTrajectory
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.leg_clearance import Clearance, leg_clearance
from hexapod_pin.control.sampled_trajectory import SampledTrajectory

__all__ = [
    "Clearance",
    "Controller",
    "FootPath",
    "Gait",
    "HoldPosture",
    "JointTrajectory",
    "KinematicControl",
    "SampledTrajectory",
    "feasible_gait",
    "leg_clearance",
]
