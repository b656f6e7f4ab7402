"""Faults of a URDF are found and repaired; every change is reported."""

from hexapod_pin.robot.repair.find_all import find_all
from hexapod_pin.robot.repair.finding import Finding, FoldedFinding, RepairOptions, folded
from hexapod_pin.robot.repair.repair_urdf import MassRow, Repaired, repair_urdf

__all__ = [
    "Finding",
    "FoldedFinding",
    "MassRow",
    "RepairOptions",
    "Repaired",
    "find_all",
    "folded",
    "repair_urdf",
]
