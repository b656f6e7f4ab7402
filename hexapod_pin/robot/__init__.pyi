"""The public names of this package: `__init__.py` imports each when it is first used."""

from .description.blueprint import Blueprint as Blueprint
from .description.blueprint import Hip as Hip
from .description.blueprint import Segment as Segment
from .description.blueprint import Trunk as Trunk
from .leg_kinematics import LegKinematics as LegKinematics
from .link_shapes import TrunkPoints as TrunkPoints
from .link_shapes import trunk_points as trunk_points
from .loading.pin_model import Foot as Foot
from .robot import Leg as Leg
from .robot import Robot as Robot
from .robot import load_robot as load_robot
from .robot_source import urdf_path as urdf_path
from .state import State as State
from .static_margins import longitudinal_margins as longitudinal_margins
from .static_margins import static_margin as static_margin
from .static_margins import support_polygon as support_polygon
from .urdf_report import UrdfReport as UrdfReport
from .urdf_report import inspect as inspect
