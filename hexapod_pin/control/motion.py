"""Motions: functions of time, arcs, velocity commands, fitted gaits, postures, plans."""

from hexapod_pin.control.arc_walk import ArcWalk, paper_motion
from hexapod_pin.control.body_motion import BodyMotion
from hexapod_pin.control.commanded_body import VelocityCommand
from hexapod_pin.control.curves import (
    Havsin,
    Hermite,
    Sine,
    Step,
    Step5,
    VelocityStep,
    Waypoints,
)
from hexapod_pin.control.feasible_gait import default_gait, fit_gait
from hexapod_pin.control.joint_motion import JointMotion
from hexapod_pin.control.posture import least_torque_posture, posture_cost
from hexapod_pin.control.sampled_trajectory import SampledTrajectory
from hexapod_pin.control.stroke_posture import longest_stroke_posture
from hexapod_pin.control.time_function import Periodic, Sum
from hexapod_pin.control.walk_plan import PlannedInstant, WalkPlan

__all__ = [
    "ArcWalk",
    "BodyMotion",
    "Havsin",
    "Hermite",
    "JointMotion",
    "Periodic",
    "PlannedInstant",
    "SampledTrajectory",
    "Sine",
    "Step",
    "Step5",
    "Sum",
    "VelocityCommand",
    "VelocityStep",
    "WalkPlan",
    "Waypoints",
    "default_gait",
    "fit_gait",
    "least_torque_posture",
    "longest_stroke_posture",
    "paper_motion",
    "posture_cost",
]
