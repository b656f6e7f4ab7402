"""Many runs for one question: controllers compared, parameters tuned, grids, whole studies."""

from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.gait_energy import GaitEnergy, load_gait_energy
from hexapod_pin.results.motor_selection import MotorSelection
from hexapod_pin.results.peak_verdict import PeakVerdict, PeakVerdicts
from hexapod_pin.results.torque_map import TorqueMap, load_torque_map
from hexapod_pin.results.trace_file import load_study, write_study
from hexapod_pin.results.walk_metrics import WalkMetrics
from hexapod_pin.study.assumed_inputs import assumed_inputs
from hexapod_pin.study.compare import compare
from hexapod_pin.study.gait_energy import gait_energy, study_gaits
from hexapod_pin.study.judge_peaks import judge_peaks
from hexapod_pin.study.runs import SweepResult, open_sweep, run_sweep
from hexapod_pin.study.runs.measure import SUMMARY, Measure
from hexapod_pin.study.runs.runner import Rows, Runner, RunOptions, run_study
from hexapod_pin.study.selection import select_motors
from hexapod_pin.study.sweep import SweepStudy, load_sweep
from hexapod_pin.study.sweep.scene_inputs import random_bumps
from hexapod_pin.study.torque_map import torque_map
from hexapod_pin.study.tuning import tune
from hexapod_pin.study.tuning_result import RelativeObjective, TuningResult
from hexapod_pin.study.uncertainty import SobolIndices, Uncertainty, sobol_indices, uncertainty

__all__ = [
    "Comparison",
    "GaitEnergy",
    "Measure",
    "MotorSelection",
    "PeakVerdict",
    "PeakVerdicts",
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
    "load_gait_energy",
    "load_study",
    "load_sweep",
    "load_torque_map",
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
    "write_study",
]
