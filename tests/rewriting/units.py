"""A robot in units that a URDF does not have: what exporters get wrong."""

from __future__ import annotations

from rewriting.parts import RobotParts

MILLI = 1e-3


def in_units(robot: RobotParts, units: str) -> None:
    """Write the numbers of a robot in units of `UNITS`; parts are changed in place.

    "kg mm2": inertias alone; "gram": masses in g and inertias in g m^2; "millimetre": all lengths
    in mm (inertias in kg mm^2).
    """
    mass, length, inertia = {
        "si": (1.0, 1.0, 1.0),
        "kg mm2": (1.0, 1.0, MILLI**2),
        "gram": (MILLI, 1.0, MILLI),
        "millimetre": (1.0, MILLI, MILLI**2),
    }[units]
    for link in robot.links:
        if link.mass is not None:
            link.mass, link.inertia = link.mass / mass, link.inertia / inertia
        link.com = link.com / length
        for shape in link.shapes:
            shape.place.p = shape.place.p / length
            if length != 1.0:
                shape.size = _resized(shape.kind, shape.size, length)
    for joint in robot.joints:
        joint.place.p = joint.place.p / length


def _resized(kind: str, size: dict[str, str], length: float) -> dict[str, str]:
    """Return the attributes of a geometry, each length divided by a length."""
    if kind == "mesh":
        size = {"scale": "1 1 1", **size}
    return {
        name: value if name == "filename" else _scaled(value, length)
        for name, value in size.items()
    }


def _scaled(numbers: str, length: float) -> str:
    """Return numbers in a text, each divided by a length."""
    return " ".join(repr(float(value) / length) for value in numbers.split())
