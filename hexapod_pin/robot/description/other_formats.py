"""What a file is that is no URDF, and how to make one of it."""

from __future__ import annotations

import xml.etree.ElementTree as ET

_ADVICE = {
    "sdf": "an SDF (Gazebo) file: convert it with pysdf, or take the "
    "URDF or xacro file that it was made from",
    "mujoco": "an MJCF (MuJoCo) file: convert it with mjcf-urdf-simple-converter, or take "
    "the URDF that it was made from",
    "mujocoinclude": "a part of an MJCF (MuJoCo) file: a URDF is needed",
    "launch": "a launch file: give the URDF or xacro file that it loads (see its "
    "robot_description), its arguments by xacro_args=[...]",
    "package": "a package's manifest: give the URDF or xacro file, often in its folder urdf",
    "COLLADA": "a mesh: give the URDF that names it",
    "model": "a model of OpenSim or part of an SDF file: convert it to URDF",
    "openrave": "an OpenRAVE file: convert it to URDF",
}


def advice_on(root: ET.Element) -> str:
    """Return what a file with another outermost element is and what to do; empty if unknown."""
    tag = root.tag.rpartition("}")[2]
    robots = root.findall(".//robot")
    if tag in _ADVICE:
        return f" (this is {_ADVICE[tag]})"
    if len(robots) > 1:
        names = ", ".join(repr(robot.get("name", "")) for robot in robots[:5])
        return f" (it holds {len(robots)} robots, {names}: put one in a file of its own)"
    return " (put the <robot> in it in a file of its own)" if robots else ""
