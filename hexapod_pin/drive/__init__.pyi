"""The public names of this package: `__init__.py` imports each when it is first used."""

from .catalog import Catalog as Catalog
from .catalog import MotorRecord as MotorRecord
from .catalog import load_catalog as load_catalog
from .catalog.motor_record import Derating as Derating
from .joint_stops import JointStops as JointStops
from .motor import Motor as Motor
from .servo import Servo as Servo
