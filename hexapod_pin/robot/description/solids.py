"""Inertias of homogeneous solids, and the unit converters of published tables."""

from __future__ import annotations

from collections.abc import Iterable

from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.description.urdf_file import LARGEST_LENGTH

Vector = tuple[float, float, float]


def kg_mm2(ixx: float, iyy: float, izz: float) -> Vector:
    """Convert principal moments of inertia from kg mm^2 (the unit of S2 Table 1) to kg m^2."""
    return ixx / 1e6, iyy / 1e6, izz / 1e6


def mm(*lengths: float) -> tuple[float, ...]:
    """Convert lengths from mm to m."""
    return tuple(length / 1e3 for length in lengths)


def box_inertia(mass: float, size: Vector) -> Vector:
    """Return (ixx, iyy, izz) [kg m^2] of a solid box about its centre.

    Args:
        mass: mass [kg].
        size: full edge lengths along x, y, z [m].

    Raises:
        ParameterError: a length is beyond `LARGEST_LENGTH`.
    """
    _require_lengths(size)
    x, y, z = (edge**2 for edge in size)
    return mass / 12 * (y + z), mass / 12 * (x + z), mass / 12 * (x + y)


def rod_inertia(mass: float, length: float, radius: float) -> Vector:
    """Return (ixx, iyy, izz) [kg m^2] of a solid cylinder about its centre, its axis along x.

    Args:
        mass: mass [kg].
        length: length along x [m].
        radius: radius [m].

    Raises:
        ParameterError: a length is beyond `LARGEST_LENGTH`.
    """
    _require_lengths((length, radius))
    across = mass / 12 * (3 * radius**2 + length**2)
    return mass / 2 * radius**2, across, across


def _require_lengths(lengths: Iterable[float]) -> None:
    for length in lengths:
        if not abs(length) <= LARGEST_LENGTH:
            raise ParameterError("length", length, f"at most {LARGEST_LENGTH:g} m")
