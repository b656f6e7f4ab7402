"""A robot recognised from its geometry alone."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import UrdfFile, parse_urdf
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.recognition.layout import RobotHints, RobotLayout
from hexapod_pin.robot.recognition.recognise import recognise
from hexapod_pin.robot.rotations import rotation


def stripped_file(text: str) -> UrdfFile:
    """Return a URDF without what its text states itself."""
    root = ET.fromstring(text)
    for own in root.findall("hexapod_pin"):
        root.remove(own)
    return parse_urdf(ET.tostring(root), "rewritten.urdf")


def found(text: str, folder: Path = Path("."), **hints: object) -> RobotLayout:
    """Recognise a robot in a folder without what its text states itself."""
    finder = ResourceFinder(folder / "rewritten.urdf")
    return recognise(stripped_file(text), finder, RobotHints(**hints))  # type: ignore[arg-type]


def about_z(degrees: float) -> Array:
    return rotation((0.0, 0.0, math.radians(degrees)))
