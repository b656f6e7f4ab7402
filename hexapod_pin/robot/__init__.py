"""Robots: URDF and blueprints, loading, legs and their kinematics, states."""

from hexapod_pin.robot.description.blueprint import Blueprint, Hip, Segment, Trunk
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.link_shapes import TrunkPoints, trunk_points
from hexapod_pin.robot.loading.pin_model import Foot
from hexapod_pin.robot.robot import Leg, Robot, load_robot, urdf_path
from hexapod_pin.robot.state import State
from hexapod_pin.robot.urdf_report import UrdfReport, inspect

__all__ = [
    "Blueprint",
    "Foot",
    "Hip",
    "Leg",
    "LegKinematics",
    "Robot",
    "Segment",
    "State",
    "Trunk",
    "TrunkPoints",
    "UrdfReport",
    "inspect",
    "load_robot",
    "trunk_points",
    "urdf_path",
]
