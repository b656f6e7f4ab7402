"""Robots: URDF and blueprints, loading, legs and their kinematics, states."""

from hexapod_pin.robot.description.blueprint import Blueprint as Blueprint
from hexapod_pin.robot.robot import Foot as Foot
from hexapod_pin.robot.robot import Leg as Leg
from hexapod_pin.robot.robot import Robot as Robot
from hexapod_pin.robot.robot import load_robot as load_robot
from hexapod_pin.robot.robot import urdf_path as urdf_path
from hexapod_pin.robot.state import State as State
