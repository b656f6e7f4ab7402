"""Many runs for one question: controllers compared, parameters tuned, grids, whole studies."""

from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.gait_energy import GaitEnergy
from hexapod_pin.results.motor_selection import MotorSelection
from hexapod_pin.results.torque_map import TorqueMap
from hexapod_pin.results.walk_metrics import WalkMetrics
from hexapod_pin.sweep.assumed_inputs import assumed_inputs
from hexapod_pin.sweep.compare import compare
from hexapod_pin.sweep.gait_energy import gait_energy, study_gaits
from hexapod_pin.sweep.judge_peaks import judge_peaks
from hexapod_pin.sweep.runs import SweepResult, open_sweep, run_sweep
from hexapod_pin.sweep.runs.measure import SUMMARY, Measure
from hexapod_pin.sweep.runs.runner import Rows, Runner, RunOptions, run_study
from hexapod_pin.sweep.selection import select_motors
from hexapod_pin.sweep.study import SweepStudy, load_sweep
from hexapod_pin.sweep.study.scene_inputs import random_bumps
from hexapod_pin.sweep.torque_map import torque_map
from hexapod_pin.sweep.tuning import tune
from hexapod_pin.sweep.tuning_result import RelativeObjective, TuningResult
from hexapod_pin.sweep.uncertainty import SobolIndices, Uncertainty, sobol_indices, uncertainty

__all__ = [
    "Comparison",
    "GaitEnergy",
    "Measure",
    "MotorSelection",
    "RelativeObjective",
    "Rows",
    "RunOptions",
    "Runner",
    "SUMMARY",
    "SobolIndices",
    "SweepResult",
    "SweepStudy",
    "TorqueMap",
    "TuningResult",
    "Uncertainty",
    "WalkMetrics",
    "assumed_inputs",
    "compare",
    "gait_energy",
    "judge_peaks",
    "load_sweep",
    "open_sweep",
    "random_bumps",
    "run_study",
    "run_sweep",
    "select_motors",
    "sobol_indices",
    "study_gaits",
    "torque_map",
    "tune",
    "uncertainty",
]
