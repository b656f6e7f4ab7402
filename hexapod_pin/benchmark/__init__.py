"""Measurements of speed and error of this package and of other engines.

`work_precision` measures a task with entries (our methods, and those of `engines`) against a
reference; `report` writes what it found; `advice` recommends a method for a scene; `hard_suite` is
`bench --hard`, and `calibration` its comparison of the error with the requested accuracy.
"""

from hexapod_pin.benchmark.advice import Advice as Advice
from hexapod_pin.benchmark.advice import advise as advise
