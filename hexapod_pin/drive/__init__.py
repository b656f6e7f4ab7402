"""Drives: joint servos, motors and joint stops."""

from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.motor import Motor
from hexapod_pin.drive.servo import Servo

__all__ = ["JointStops", "Motor", "Servo"]
