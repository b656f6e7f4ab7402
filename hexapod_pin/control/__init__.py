"""Controllers: gaits, foot paths, joint trajectories planned before a run."""

from hexapod_pin.control.body_motion import BodyMotion
from hexapod_pin.control.feasible_gait import feasible_gait
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.hold_posture import HoldPosture
from hexapod_pin.control.joint_trajectory import Controller, JointTrajectory
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.sampled_trajectory import SampledTrajectory
from hexapod_pin.control.time_function import Sine, Waypoints
from hexapod_pin.control.velocity_command import VelocityCommand

__all__ = [
    "BodyMotion",
    "Controller",
    "FootPath",
    "Gait",
    "HoldPosture",
    "JointTrajectory",
    "KinematicControl",
    "SampledTrajectory",
    "Sine",
    "VelocityCommand",
    "Waypoints",
    "feasible_gait",
]
