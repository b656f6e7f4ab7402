"""Sizing: what the joints demand of any motor, and how a motor of the catalogue fares with it."""

from hexapod_pin.drive.catalog import Catalog, MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.drive.winding import Winding
from hexapod_pin.results.sizing.battery import BatteryLoad
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_budget import MotorBudget, motor_budget
from hexapod_pin.results.sizing.motor_use import MotorUse
from hexapod_pin.results.sizing.ranking import (
    LightestMotor,
    MotorRanking,
    lightest_motors,
    motor_ranking,
)
from hexapod_pin.results.sizing.trace_demand import joint_demand
from hexapod_pin.results.sizing.walking_heat import WalkingHeat, walking_heat

__all__ = [
    "BatteryLoad",
    "Catalog",
    "Derating",
    "JointDemand",
    "LightestMotor",
    "MotorBudget",
    "MotorRanking",
    "MotorRecord",
    "MotorUse",
    "WalkingHeat",
    "Winding",
    "joint_demand",
    "lightest_motors",
    "motor_budget",
    "motor_ranking",
    "walking_heat",
]
