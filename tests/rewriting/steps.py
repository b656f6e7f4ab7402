"""A robot rewritten step by step: base frames, signs, zeros, names, nested links, foot frames."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import UrdfFile, parse_urdf
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.recognition.layout import RobotHints, RobotLayout
from hexapod_pin.robot.recognition.recognise import recognise
from rewriting import moves
from rewriting.naming import rename
from rewriting.parts import JointPart, Placement, parts_of, rotation
from rewriting.shape_files import mesh_of, stl_bytes
from rewriting.writing import text_of

BRACKET = Placement(rotation((0.3, -0.2, 0.5)), np.array([0.01, -0.02, 0.03]))
"""Where a nested link lies in its parent."""


class Rewriter:
    """A URDF without its own statements, to which steps are applied one after another.

    Attributes:
        parts: its links and joints.
        turn: from the original root frame to the new one. Shape (3, 3).
        zero: joint's new name -> its angle where the original's is zero [rad].
    """

    def __init__(self, text: str) -> None:
        """Take a URDF's text."""
        self.parts = parts_of(stripped_file(text))
        self.turn = np.eye(3)
        self.zero: dict[str, float] = {}

    @classmethod
    def packaged(cls, name: str) -> Rewriter:
        """Start from a robot of the package."""
        return cls(hp.load_robot(name).urdf)

    def file(self) -> UrdfFile:
        """Return what was written."""
        return parse_urdf(text_of(self.parts).encode(), "rewritten.urdf")

    def turned(self, turn: Array) -> Rewriter:
        """Give the root link's frame other axes: old coordinates become turn @ old ones."""
        self.turn = turn @ self.turn
        moves.move_frame(self.parts, self.parts.root, Placement(turn))
        return self

    def flipped(self, every: int = 1) -> Rewriter:
        """Reverse the axis of every so-manieth moved joint, and its limits."""
        for joint in self._moved()[::every]:
            moves.flip_axis(joint)
            self.zero[joint.name] = -self.zero.get(joint.name, 0.0)
        return self

    def shifted(self, angles: Mapping[str, float]) -> Rewriter:
        """Call the place at these angles zero, for every joint whose name contains the key."""
        for joint in self._moved():
            for part, angle in angles.items():
                if part in joint.name:
                    moves.shift_zero(joint, angle)
                    self.zero[joint.name] = self.zero.get(joint.name, 0.0) - angle
        return self

    def nested(self) -> Rewriter:
        """Put a massless link, turned and moved, between every moved joint and its parent."""
        for joint in self._moved():
            moves.put_fixed_link_before(self.parts, joint, BRACKET)
        return self

    def renamed(self) -> Rewriter:
        """Give all links and joints names without meaning."""
        names = rename(self.parts, "nonsense", np.random.default_rng(0))
        self.zero = {names[name]: angle for name, angle in self.zero.items()}
        return self

    def feet_at_knees(self) -> Rewriter:
        """Put the frames of the foot links at the knees; their spheres stay where they are."""
        for joint in self.parts.joints:
            if joint.name.endswith("foot_joint"):
                moves.place_foot(self.parts, joint, "at the knee")
        return self

    def feet_as_meshes(self, folder: Path) -> Rewriter:
        """Write the spheres of the feet as triangles in an STL file in a folder."""
        for shape in (shape for link in self.parts.links for shape in link.shapes):
            if shape.kind == "sphere":
                (folder / "ball.stl").write_bytes(stl_bytes(*mesh_of("sphere", shape.size)))
                shape.kind, shape.size = "mesh", {"filename": "ball.stl"}
        return self

    def _moved(self) -> list[JointPart]:
        return [joint for joint in self.parts.joints if joint.kind == "revolute"]


def stripped_file(text: str) -> UrdfFile:
    """Return a URDF without what its text states itself."""
    root = ET.fromstring(text)
    for own in root.findall("hexapod_pin"):
        root.remove(own)
    return parse_urdf(ET.tostring(root), "rewritten.urdf")


def found(robot: str | Rewriter, folder: Path = Path("."), **hints: object) -> RobotLayout:
    """Recognise a robot in a folder without what its text states itself."""
    file = stripped_file(robot) if isinstance(robot, str) else robot.file()
    return recognise(file, ResourceFinder(folder / "rewritten.urdf"), RobotHints(**hints))  # type: ignore[arg-type]


def about_z(degrees: float) -> Array:
    """Return the turn (3, 3) about z."""
    return rotation((0.0, 0.0, math.radians(degrees)))
