"""Results: traces, checkpoints, torque budgets; pure data and what is read from it."""

from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.peak_verdict import PeakVerdict, PeakVerdicts
from hexapod_pin.results.robot_budget import TorqueBudget
from hexapod_pin.results.summary import Summary, load_summary
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import load_trace
from hexapod_pin.results.walk_metrics import WalkMetrics

__all__ = [
    "Checkpoint",
    "Comparison",
    "PeakVerdict",
    "PeakVerdicts",
    "Summary",
    "TorqueBudget",
    "Trace",
    "WalkMetrics",
    "load_summary",
    "load_trace",
    "torque_budget",
]
