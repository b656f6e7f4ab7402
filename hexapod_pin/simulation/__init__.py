"""Simulation: scenes, cases, methods, runs, sessions and batches over the native core."""

from hexapod_pin.simulation.amplification import Amplification, amplification
from hexapod_pin.simulation.batch import iterate_batch, simulate_batch
from hexapod_pin.simulation.case import Case, load_case, simulate
from hexapod_pin.simulation.loaded_model import loaded_model
from hexapod_pin.simulation.loads import LostLeg, MassFactor, Payload, Push, RemovedMass
from hexapod_pin.simulation.methods import METHODS, Method
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.simulation.session import Session
from hexapod_pin.simulation.work_limits import WorkLimits

__all__ = [
    "Amplification",
    "Case",
    "LostLeg",
    "METHODS",
    "MassFactor",
    "Method",
    "Payload",
    "Push",
    "RemovedMass",
    "Scene",
    "Session",
    "WorkLimits",
    "amplification",
    "iterate_batch",
    "load_case",
    "loaded_model",
    "simulate",
    "simulate_batch",
]
