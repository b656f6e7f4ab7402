"""Simulation: cases, methods, runs, sessions and batches over the native core."""

from hexapod_pin.simulation.amplification import Amplification, amplification
from hexapod_pin.simulation.batch import iterate_batch, simulate_batch
from hexapod_pin.simulation.case import Case, load_case, simulate
from hexapod_pin.simulation.methods import METHODS, Method
from hexapod_pin.simulation.run_settings import WorkLimits
from hexapod_pin.simulation.session import Session

__all__ = [
    "Amplification",
    "Case",
    "METHODS",
    "Method",
    "Session",
    "WorkLimits",
    "amplification",
    "iterate_batch",
    "load_case",
    "simulate",
    "simulate_batch",
]
