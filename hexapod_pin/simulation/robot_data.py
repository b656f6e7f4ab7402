"""A robot as plain data: where its file is, what it contained, and how it was loaded."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.robot import PACKAGED, Robot, load_robot


def robot_to_dict(robot: Robot) -> dict[str, Any]:
    """Return what `read_robot` takes; a path is absolute."""
    packaged = robot.source in PACKAGED
    return {
        "source": robot.source if packaged else str(Path(robot.source).expanduser().absolute()),
        "feet": [foot.name for foot in robot.feet],
        "foot_radius": [float(foot.radius) for foot in robot.feet],
        "posture": robot.posture.tolist(),
        "digest": robot.digest,
    }


def read_robot(data: Mapping[str, Any]) -> Robot:
    """Load a robot again, with the foot radius and the posture that it was loaded with.

    Raises:
        ParameterError: the file has changed, or does not give such feet.
        UrdfError: the file is not usable.
        UnknownNameError: there is no such robot.
    """
    source, feet = data["source"], data.get("feet")
    robot = load_robot(source, feet=feet)
    if data.get("digest", robot.digest) != robot.digest:
        raise ParameterError(
            "robot.digest", data["digest"], "that of the file", "The URDF has changed."
        )
    radii = data.get("foot_radius", [foot.radius for foot in robot.feet])
    posture = data.get("posture", robot.posture.tolist())
    options: dict[str, Any] = {}
    if radii != [foot.radius for foot in robot.feet]:
        options["foot_radius"] = radii[0] if isinstance(radii, list) and radii else radii
    if posture != robot.posture.tolist():
        options["posture"] = posture
    if options:
        robot = load_robot(source, feet=feet, **options)
    if radii != [foot.radius for foot in robot.feet]:
        raise ParameterError(
            "robot.foot_radius", radii, "the file's own, or one radius for all [m]"
        )
    return robot
