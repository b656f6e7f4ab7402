"""The same robot written otherwise: base frames, signs, zeros, names, nested links, foot frames."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rewriting.parts import about, roll_pitch_yaw

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import UrdfFile, origin, parse_urdf
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.recognition.layout import RobotHints, RobotLayout
from hexapod_pin.robot.recognition.recognise import recognise
from hexapod_pin.robot.rotations import rotation


class Rewritten:
    """A URDF that is rewritten step by step.

    Attributes:
        root: its XML.
        turn: from the original root frame to the new one. Shape (3, 3).
        zero: joint's new name -> its angle where the original's is zero [rad].
    """

    def __init__(self, text: str, *, stated: bool = False) -> None:
        """Take a URDF's text, without its own statements unless `stated`."""
        self.root = ET.fromstring(text)
        self.turn = np.eye(3)
        self.zero: dict[str, float] = {}
        for own in self.root.findall("hexapod_pin"):
            if not stated:
                self.root.remove(own)

    @classmethod
    def packaged(cls, name: str, *, stated: bool = False) -> Rewritten:
        """Start from a robot of the package."""
        return cls(hp.load_robot(name).urdf, stated=stated)

    def file(self) -> UrdfFile:
        """Return what was written."""
        return parse_urdf(ET.tostring(self.root), "rewritten.urdf")

    def turned(self, turn: Array, base: str = "base_link") -> Rewritten:
        """Give the root link's frame other axes: old coordinates become turn @ old ones."""
        self.turn = turn @ self.turn
        link = next(x for x in self.root.findall("link") if x.get("name") == base)
        joints = [x for x in self.root.findall("joint") if x.find("parent").get("link") == base]
        for element in [*link, *joints]:
            xyz, rpy = origin(element)
            _place(element, turn @ np.array(xyz), turn @ rotation(rpy))
        return self

    def flipped(self, every: int = 1) -> Rewritten:
        """Reverse the axis of every so-manieth moved joint, and its limits."""
        for joint in self._moved()[::every]:
            axis, limit = joint.find("axis"), joint.find("limit")
            axis.set("xyz", " ".join(repr(-float(x)) for x in axis.get("xyz").split()))
            lower, upper = float(limit.get("lower")), float(limit.get("upper"))
            limit.set("lower", repr(-upper))
            limit.set("upper", repr(-lower))
            name = joint.get("name")
            self.zero[name] = -self.zero.get(name, 0.0)
        return self

    def shifted(self, angles: Mapping[str, float]) -> Rewritten:
        """Call the place at these angles zero, for every joint whose name contains the key."""
        for joint in self._moved():
            for part, angle in angles.items():
                if part in joint.get("name"):
                    self._shift(joint, angle)
        return self

    def nested(self) -> Rewritten:
        """Put a massless link, turned and moved, between every moved joint and its parent."""
        for joint in self._moved():
            name = f"bracket_{joint.get('name')}"
            turn = rotation((0.3, -0.2, 0.5))
            move = np.array([0.01, -0.02, 0.03])
            xyz, rpy = origin(joint)
            fixed = ET.SubElement(self.root, "joint", name=f"fixed_{name}", type="fixed")
            ET.SubElement(fixed, "parent", link=joint.find("parent").get("link"))
            ET.SubElement(fixed, "child", link=name)
            _place(fixed, move, turn)
            ET.SubElement(self.root, "link", name=name)
            joint.find("parent").set("link", name)
            _place(joint, turn.T @ (np.array(xyz) - move), turn.T @ rotation(rpy))
        return self

    def renamed(self) -> Rewritten:
        """Give all links and joints names without meaning."""
        links = [x.get("name") for x in self.root.findall("link")]
        new = {name: f"part{(7 * k) % 97}" for k, name in enumerate(links)}
        for k, joint in enumerate(self.root.findall("joint")):
            name = f"q{(5 * k) % 89}"
            if joint.get("name") in self.zero:
                self.zero[name] = self.zero.pop(joint.get("name"))
            joint.set("name", name)
            for end in ("parent", "child"):
                joint.find(end).set("link", new[joint.find(end).get("link")])
        for link in self.root.findall("link"):
            link.set("name", new[link.get("name")])
        return self

    def feet_at_knees(self) -> Rewritten:
        """Put the frames of the foot links at the knees; their spheres stay where they are."""
        for joint in self.root.findall("joint"):
            if joint.get("name").endswith("foot_joint"):
                xyz, rpy = origin(joint)
                _place(joint, np.zeros(3), np.eye(3))
                name = joint.find("child").get("link")
                link = next(x for x in self.root.findall("link") if x.get("name") == name)
                for element in link:
                    _place(element, np.array(xyz), rotation(rpy))
        return self

    def feet_as_meshes(self, folder: Path, radius: float) -> Rewritten:
        """Write the feet's spheres as triangles in an STL file in a folder."""
        path = folder / "ball.stl"
        path.write_text(stl_text(ball_triangles(radius)))
        for sphere in self.root.findall(".//geometry/sphere/.."):
            sphere.clear()
            ET.SubElement(sphere, "mesh", filename="ball.stl")
        return self

    def without(self, *tags: str) -> Rewritten:
        """Leave out elements of all links."""
        for link in self.root.findall("link"):
            for element in [e for tag in tags for e in link.findall(tag)]:
                link.remove(element)
        return self

    def _moved(self) -> list[ET.Element]:
        return [joint for joint in self.root.findall("joint") if joint.get("type") == "revolute"]

    def _shift(self, joint: ET.Element, angle: float) -> None:
        xyz, rpy = origin(joint)
        axis = np.array([float(x) for x in joint.find("axis").get("xyz").split()])
        _place(joint, np.array(xyz), rotation(rpy) @ about(axis, angle))
        for end in ("lower", "upper"):
            limit = joint.find("limit")
            limit.set(end, repr(float(limit.get(end)) - angle))
        name = joint.get("name")
        self.zero[name] = self.zero.get(name, 0.0) - angle


def found(robot: str | Rewritten, folder: Path = Path("."), **hints: object) -> RobotLayout:
    """Recognise a robot in a folder without what its text states itself."""
    file = (Rewritten(robot) if isinstance(robot, str) else robot).file()
    return recognise(file, ResourceFinder(folder / "rewritten.urdf"), RobotHints(**hints))  # type: ignore[arg-type]


def ball_triangles(radius: float) -> Array:
    """Return an octahedron divided three times on a sphere. Shape (512, 3, 3)."""
    corners = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=float)
    top, faces = np.array([0.0, 0.0, 1.0]), []
    for k in range(4):
        a, b = corners[k], corners[(k + 1) % 4]
        faces += [(a, b, top), (b, a, -top)]
    for _ in range(3):
        split = []
        for a, b, c in faces:
            ab, bc, ca = ((u + v) / np.linalg.norm(u + v) for u, v in ((a, b), (b, c), (c, a)))
            split += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = split
    return radius * np.array(faces)


def stl_text(triangles: Array) -> str:
    """Return an ASCII STL of triangles (N, 3, 3)."""
    lines = ["solid ball"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x:.17g} {y:.17g} {z:.17g}" for x, y, z in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid ball", ""])


def about_z(degrees: float) -> Array:
    """Return the turn (3, 3) about z."""
    return rotation((0.0, 0.0, math.radians(degrees)))


def _place(element: ET.Element, xyz: Array, turn: Array) -> None:
    """Write an element's <origin>."""
    found = element.find("origin")
    found = ET.SubElement(element, "origin") if found is None else found
    for name, values in (("xyz", xyz), ("rpy", roll_pitch_yaw(turn))):
        found.set(name, " ".join(repr(float(x)) for x in values))
