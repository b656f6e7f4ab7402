"""Simulation: scenes, methods, runs and batches over the native core."""

from hexapod_pin.simulation.batch import simulate_batch as simulate_batch
from hexapod_pin.simulation.case import Case as Case
from hexapod_pin.simulation.run import simulate as simulate
from hexapod_pin.simulation.scene import Scene as Scene
