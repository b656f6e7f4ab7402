"""Results: traces, checkpoints, torque budgets; pure data and what is read from it."""

from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.robot_budget import TorqueBudget
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import load_trace

__all__ = ["Checkpoint", "TorqueBudget", "Trace", "load_trace", "torque_budget"]
