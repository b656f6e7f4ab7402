"""What studies return and read again: classes of `results`, listed at `hexapod_pin.study` too."""

from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.gait_energy import GaitEnergy, load_gait_energy
from hexapod_pin.results.motor_selection import MotorSelection
from hexapod_pin.results.peak_verdict import PeakVerdict, PeakVerdicts
from hexapod_pin.results.torque_map import TorqueMap, load_torque_map
from hexapod_pin.results.trace_file import load_study, write_study
from hexapod_pin.results.walk_metrics import WalkMetrics

__all__ = [
    "Comparison",
    "GaitEnergy",
    "MotorSelection",
    "PeakVerdict",
    "PeakVerdicts",
    "TorqueMap",
    "WalkMetrics",
    "load_gait_energy",
    "load_study",
    "load_torque_map",
    "write_study",
]
