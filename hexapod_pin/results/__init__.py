"""Results: traces, checkpoints, torque budgets; pure data and what is read from it."""

from hexapod_pin.results.checkpoint import Checkpoint as Checkpoint
from hexapod_pin.results.robot_budget import TorqueBudget as TorqueBudget
from hexapod_pin.results.torque_budget import torque_budget as torque_budget
from hexapod_pin.results.trace import Trace as Trace
from hexapod_pin.results.trace_file import load_trace as load_trace
