"""The public names of this package: `__init__.py` imports each when it is first used."""

from .battery import Battery as Battery
from .catalog import Catalog as Catalog
from .catalog import MotorRecord as MotorRecord
from .catalog import load_catalog as load_catalog
from .catalog.identified import IdentifiedDrive as IdentifiedDrive
from .catalog.identified import identified_drive as identified_drive
from .catalog.identified import identified_drives as identified_drives
from .catalog.motor_record import Derating as Derating
from .firmware import Firmware as Firmware
from .gear_friction import GearFriction as GearFriction
from .joint_stops import JointStops as JointStops
from .motor import Motor as Motor
from .servo import Servo as Servo
from .supplied_drives import SupplyCourse as SupplyCourse
