"""Studies of short walks for the tests of sweeps, and how their datasets are compared."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from xarray import Dataset

from hexapod_pin.study.sweep import SweepStudy

FIXED_STEPS = 'method = "robust"\nstep = 2e-3\n'
"""How the walks are run: most tests of sweeps need their numbers only to be the same again."""

BASE = f"""
schema = 1
name = "short walks"

[base]
robot = "kharagpur"
gait = {{ name = "tripod", stroke = 0.04, cycle_time = 0.3 }}
duration = 0.9
{FIXED_STEPS}"""

PAYLOADS = """
[[vary]]
input = "payload"
values = [0.0, 0.5, 1.0]
"""

FRICTIONS = """
[[vary]]
input = "mu"
distribution = "uniform"
low = 0.5
high = 0.9

[design]
kind = "random"
samples = {samples}
seed = {seed}
"""


def study_text(samples: int = 4, seed: int = 7, more: str = "") -> str:
    return BASE + PAYLOADS + more + FRICTIONS.format(samples=samples, seed=seed)


def small_study(samples: int = 4, seed: int = 7) -> SweepStudy:
    return SweepStudy.from_toml(study_text(samples, seed))


def adaptive_study() -> SweepStudy:
    """Three short walks whose steps adapt, so that their numbers have errors."""
    return SweepStudy.from_toml(study_text(1).replace(FIXED_STEPS, "accuracy = 1e-2\n"))


def partly_impossible() -> SweepStudy:
    return SweepStudy.from_toml(BASE + durations(0.9, 0.92, -1.0, 0.94))


def durations(*values: float) -> str:
    return f'\n[[vary]]\npath = "run.duration"\nvalues = {list(values)}\n'


def write_study_file(folder: Path, samples: int = 4) -> Path:
    path = folder / "study.toml"
    path.write_text(study_text(samples))
    return path


def require_same_bits(found: Dataset, wanted: Dataset) -> None:
    """Fail unless two datasets are the same: every bit, name, label and attribute."""
    assert found.identical(wanted)
    for name, array in wanted.variables.items():
        if array.dtype.kind == "f":
            assert found.variables[name].values.tobytes() == array.values.tobytes(), name
    assert np.isfinite(wanted["torque_peak"].values).any()
