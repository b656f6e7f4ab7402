"""Finding what is wrong with a URDF, and mending it: every change is said."""

from hexapod_pin.robot.mending.find_all import find_all
from hexapod_pin.robot.mending.finding import Finding, FoldedFinding, MendOptions, folded
from hexapod_pin.robot.mending.mend_urdf import MassRow, Mended, mend_urdf

__all__ = [
    "Finding",
    "FoldedFinding",
    "MassRow",
    "MendOptions",
    "Mended",
    "find_all",
    "folded",
    "mend_urdf",
]
