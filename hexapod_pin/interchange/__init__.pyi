"""The public names of this package: `__init__.py` imports each when it is first used."""

from .mjcf import write_mjcf as write_mjcf
from .mjcf_in import MjcfRobot as MjcfRobot
from .mjcf_in import read_mjcf as read_mjcf
