"""Reading what people have: URDF and xacro files, and the meshes that they name."""

from hexapod_pin.robot.reading.mesh_file import Mesh, read_mesh
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.reading.robot_text import RobotText, read_robot_text

__all__ = ["Mesh", "ResourceFinder", "RobotText", "read_mesh", "read_robot_text"]
