"""Broken URDFs: a sound six-legged robot, and what is done to its XML to break it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hexapod_pin.robot.description.paper_robots import KHARAGPUR
from hexapod_pin.robot.description.solids import inertia_matrix, principal_moments
from hexapod_pin.robot.description.urdf_file import UrdfFile, parse_urdf
from hexapod_pin.robot.repair import Repaired, RepairOptions, repair_urdf

SOUND = KHARAGPUR.urdf()
WHOLE = parse_urdf(SOUND.encode(), "sound")

Break = Callable[[ET.Element], None]


class NoMeshes:
    """A finder that finds nothing."""

    def find(self, uri: str) -> Path | None:
        return None

    def why(self, uri: str) -> str:
        return f"{uri}: not found"


def broken(*breaks: Break) -> UrdfFile:
    root = parse_urdf(SOUND.encode(), "sound").root
    for change in breaks:
        change(root)
    return parse_urdf(ET.tostring(root), "broken.urdf")


def part(root: ET.Element, path: str) -> ET.Element:
    """Return the element at "kind name/path below"."""
    head, _, below = path.partition("/")
    kind, _, name = head.partition(" ")
    found = next(x for x in root.findall(kind) if x.get("name") == name)
    if below:
        inner = found.find(below)
        assert inner is not None, path
        return inner
    return found


def put(path: str, **attributes: str) -> Break:
    return lambda root: part(root, path).attrib.update(attributes)


def unset(path: str, name: str) -> Break:
    def change(root: ET.Element) -> None:
        del part(root, path).attrib[name]

    return change


def remove(path: str) -> Break:

    def change(root: ET.Element) -> None:
        head, _, below = path.partition("/")
        owner = part(root, "/".join([head, *below.split("/")[:-1]])) if below else root
        owner.remove(part(root, path))

    return change


def add(path: str, text: str) -> Break:
    """Append an element to another one; "" is the robot."""
    return lambda root: (part(root, path) if path else root).append(ET.fromstring(text))


def every(kind: str, path: str, **attributes: str) -> Break:

    def change(root: ET.Element) -> None:
        for element in root.findall(f"{kind}/{path}"):
            element.attrib.update(attributes)

    return change


def scale(kind: str, path: str, name: str, factor: float) -> Break:

    def change(root: ET.Element) -> None:
        for element in root.findall(f"{kind}/{path}"):
            if element.get(name) is not None:
                values = (element.get(name) or "").split()
                element.set(name, " ".join(f"{factor * float(x):.12g}" for x in values))

    return change


def all_inertias(factor: float) -> Break:
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    steps = [scale("link", "inertial/inertia", name, factor) for name in names]
    return lambda root: [step(root) for step in steps] and None


def repaired(*breaks: Break, **options: float) -> Repaired:
    return repair_urdf(broken(*breaks), NoMeshes(), RepairOptions(**options))


def masses(file: UrdfFile) -> np.ndarray:
    return np.array([link.mass or 0.0 for link in file.links])


def moments(file: UrdfFile, link: str) -> np.ndarray:
    return principal_moments(inertia_matrix(file.link_by_name[link]))


def limit(file: UrdfFile, joint: str, name: str) -> float:
    return next(j for j in file.joints if j.name == joint).limit(name)
