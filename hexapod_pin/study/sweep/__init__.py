"""Study files: what varies in a sweep, and the cases that come of it."""

from hexapod_pin.study.sweep.sweep_study import SweepStudy, load_sweep

__all__ = ["SweepStudy", "load_sweep"]
