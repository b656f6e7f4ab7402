"""Many runs for one question: controllers compared on the same scenes, parameters tuned."""

from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.walk_metrics import WalkMetrics
from hexapod_pin.sweep.compare import compare
from hexapod_pin.sweep.judge_peaks import judge_peaks
from hexapod_pin.sweep.objective import RelativeObjective
from hexapod_pin.sweep.random_bumps import random_bumps
from hexapod_pin.sweep.tuning import tune
from hexapod_pin.sweep.tuning_result import TuningResult

__all__ = [
    "Comparison",
    "RelativeObjective",
    "TuningResult",
    "WalkMetrics",
    "compare",
    "judge_peaks",
    "random_bumps",
    "tune",
]
