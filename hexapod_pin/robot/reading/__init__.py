"""Reading what people have: URDF and xacro files, and the meshes that they name."""

from hexapod_pin.robot.reading.mesh_file import Mesh, read_mesh
from hexapod_pin.robot.reading.resources import ResourceFinder

__all__ = ["Mesh", "ResourceFinder", "read_mesh"]
