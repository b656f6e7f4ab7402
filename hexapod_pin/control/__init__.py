"""Controllers: gaits, foot paths, joint trajectories; feedback controllers and their sensors."""

from hexapod_pin.control import feedback, foot_control, motion, sensors
from hexapod_pin.control.arc_path import ArcPath
from hexapod_pin.control.arc_walk import ArcWalk, paper_motion
from hexapod_pin.control.body_motion import BodyMotion
from hexapod_pin.control.commanded_body import VelocityCommand
from hexapod_pin.control.curves import Havsin, Hermite, Sine, Step, Step5, Waypoints
from hexapod_pin.control.feasible_gait import (
    FittedGait,
    default_gait,
    feasible_gait,
    fit_gait,
    named_gait,
)
from hexapod_pin.control.feedback import Command, FeedbackController, Measurement
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.gait_refusal import Clearance, leg_clearance
from hexapod_pin.control.joint_motion import JointMotion
from hexapod_pin.control.joint_trajectory import Controller, JointTrajectory
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.leg_group import LegGroup, leg_group, leg_order
from hexapod_pin.control.registry import register_controller
from hexapod_pin.control.sampled_trajectory import HoldPosture, SampledTrajectory
from hexapod_pin.control.sensors import Sensor, SensorReader, Sensors
from hexapod_pin.control.time_function import Periodic, Sum

__all__ = [
    "ArcPath",
    "ArcWalk",
    "BodyMotion",
    "Clearance",
    "Command",
    "Controller",
    "FeedbackController",
    "FittedGait",
    "FootPath",
    "Gait",
    "Havsin",
    "Hermite",
    "HoldPosture",
    "JointMotion",
    "JointTrajectory",
    "KinematicControl",
    "LegGroup",
    "Measurement",
    "Periodic",
    "SampledTrajectory",
    "Sensor",
    "SensorReader",
    "Sensors",
    "Sine",
    "Step",
    "Step5",
    "Sum",
    "VelocityCommand",
    "Waypoints",
    "default_gait",
    "feasible_gait",
    "feedback",
    "fit_gait",
    "foot_control",
    "leg_clearance",
    "leg_group",
    "leg_order",
    "motion",
    "named_gait",
    "paper_motion",
    "register_controller",
    "sensors",
]
