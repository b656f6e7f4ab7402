"""Durable sweeps: the cases of a study run on threads, processes or a cluster, and kept at once."""

from hexapod_pin.study.runs.run_sweep import run_sweep
from hexapod_pin.study.runs.sweep_result import SweepResult, open_sweep

__all__ = ["SweepResult", "open_sweep", "run_sweep"]
