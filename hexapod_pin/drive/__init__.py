"""Drives: joint servos, motors and their catalogue, joint stops."""

from hexapod_pin.drive.catalog import Catalog, MotorRecord, load_catalog
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.motor import Motor
from hexapod_pin.drive.servo import Servo

__all__ = ["Catalog", "Derating", "JointStops", "Motor", "MotorRecord", "Servo", "load_catalog"]
