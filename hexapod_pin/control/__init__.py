"""Controllers: gaits, foot paths, joint trajectories; feedback controllers and their sensors."""

from hexapod_pin.control.arc_path import ArcPath
from hexapod_pin.control.arc_walk import ArcWalk
from hexapod_pin.control.body_motion import BodyMotion
from hexapod_pin.control.curves import Hermite, Sine, Waypoints
from hexapod_pin.control.feasible_gait import FittedGait, feasible_gait, fit_gait
from hexapod_pin.control.feedback import Command, FeedbackController, Measurement
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.hold_posture import HoldPosture
from hexapod_pin.control.joint_motion import JointMotion
from hexapod_pin.control.joint_trajectory import Controller, JointTrajectory
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.leg_clearance import Clearance, leg_clearance
from hexapod_pin.control.named_gait import default_gait, named_gait
from hexapod_pin.control.paper_motion import paper_motion
from hexapod_pin.control.registry import register_controller
from hexapod_pin.control.sampled_trajectory import SampledTrajectory
from hexapod_pin.control.sensor_reader import SensorReader
from hexapod_pin.control.sensors import Sensor, Sensors
from hexapod_pin.control.six_legs import SixLegs, leg_order, six_legs
from hexapod_pin.control.step_functions import Havsin, Step, Step5
from hexapod_pin.control.time_function import Periodic, Sum
from hexapod_pin.control.velocity_command import VelocityCommand

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
    "Measurement",
    "Periodic",
    "SampledTrajectory",
    "Sensor",
    "SensorReader",
    "Sensors",
    "Sine",
    "SixLegs",
    "Step",
    "Step5",
    "Sum",
    "VelocityCommand",
    "Waypoints",
    "default_gait",
    "feasible_gait",
    "fit_gait",
    "leg_clearance",
    "leg_order",
    "named_gait",
    "paper_motion",
    "register_controller",
    "six_legs",
]
