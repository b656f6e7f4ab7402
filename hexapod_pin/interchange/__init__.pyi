"""The public names of this package: `__init__.py` imports each when it is first used."""

from .mcap import write_mcap as write_mcap
from .mcap_in import McapRecording as McapRecording
from .mcap_in import read_mcap as read_mcap
from .mjcf import write_mjcf as write_mjcf
from .mjcf_in import MjcfRobot as MjcfRobot
from .mjcf_in import read_mjcf as read_mjcf
from .servo_ticks import BusServo as BusServo
from .servo_ticks import ServoMount as ServoMount
from .servo_ticks import write_servo_ticks as write_servo_ticks
from .trajectory import write_joint_trajectory as write_joint_trajectory
