"""Results: traces, checkpoints, torque budgets; pure data and what is read from it."""

from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.gait_energy import GaitEnergy, load_gait_energy
from hexapod_pin.results.robot_budget import TorqueBudget
from hexapod_pin.results.study_file import load_study, write_study
from hexapod_pin.results.summary import Summary, load_summary
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.torque_map import TorqueMap, load_torque_map
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import load_trace
from hexapod_pin.results.walk_metrics import WalkMetrics

__all__ = [
    "Checkpoint",
    "Comparison",
    "GaitEnergy",
    "Summary",
    "TorqueBudget",
    "TorqueMap",
    "Trace",
    "WalkMetrics",
    "load_gait_energy",
    "load_study",
    "load_summary",
    "load_torque_map",
    "load_trace",
    "torque_budget",
    "write_study",
]
