"""The public names of this package: `__init__.py` imports each when it is first used."""

from .motor_study import default_study as default_study
from .selecting import load_motor_study as load_motor_study
from .selecting import select_motors as select_motors
