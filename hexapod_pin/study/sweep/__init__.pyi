"""The public names of this package: `__init__.py` imports each when it is first used."""

from .sweep_study import SweepStudy as SweepStudy
from .sweep_study import load_sweep as load_sweep
