"""The public names of this package: `__init__.py` imports each when it is first used."""

from .run_sweep import run_sweep as run_sweep
from .sweep_result import SweepResult as SweepResult
from .sweep_result import open_sweep as open_sweep
