"""Many runs for one question: controllers compared on the same scenes."""

from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.walk_metrics import WalkMetrics
from hexapod_pin.sweep.compare import compare
from hexapod_pin.sweep.random_bumps import random_bumps

__all__ = ["Comparison", "WalkMetrics", "compare", "random_bumps"]
