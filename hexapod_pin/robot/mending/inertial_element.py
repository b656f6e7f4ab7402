"""Writing the <inertial> of a link."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from hexapod_pin.arrays import Array
from hexapod_pin.robot.mending.draft import number

ENTRIES = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}


def write_inertial(link: ET.Element, mass: float, com: Array, inertia: Array) -> None:
    """Replace the <inertial> of a link.

    Args:
        link: the <link>.
        mass: [kg].
        com: centre of mass in the link's frame [m]. Shape (3,).
        inertia: about it, in the link's axes [kg m^2]. Shape (3, 3).
    """
    old = link.find("inertial")
    if old is not None:
        link.remove(old)
    inertial = ET.Element("inertial")
    inertial.tail = "\n    "
    xyz = " ".join(number(value) for value in com)
    ET.SubElement(inertial, "origin", {"xyz": xyz, "rpy": "0 0 0"})
    ET.SubElement(inertial, "mass", {"value": number(mass)})
    write_moments(ET.SubElement(inertial, "inertia"), inertia)
    link.insert(0, inertial)


def write_moments(element: ET.Element, inertia: Array) -> None:
    """Write a (3, 3) inertia [kg m^2] into an <inertia> element."""
    for name, place in ENTRIES.items():
        element.set(name, number(float(inertia[place])))
