"""Sizing: what the joints demand of any motor, and how a motor of the catalogue fares with it."""

from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_budget import (
    MotorBudget,
    MotorRanking,
    motor_budget,
    motor_ranking,
)
from hexapod_pin.results.sizing.motor_use import BatteryLoad, MotorUse
from hexapod_pin.results.sizing.trace_demand import joint_demand
from hexapod_pin.results.sizing.winding import Winding

__all__ = [
    "BatteryLoad",
    "JointDemand",
    "MotorBudget",
    "MotorRanking",
    "MotorUse",
    "Winding",
    "joint_demand",
    "motor_budget",
    "motor_ranking",
]
