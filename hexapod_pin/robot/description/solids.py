"""Masses and inertias come from homogeneous solids, or from what a URDF states for its links."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.description.urdf_file import LARGEST_LENGTH, Link, UrdfFile
from hexapod_pin.robot.rotations import rotation

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


# Masses and inertias of a URDF: of links, and of the links that move together.

INERTIA_RELATIVE_TOLERANCE = 1e-9
"""Relative slack of the triangle inequality and of positive eigenvalues (round-off in the file)."""


def bodies(file: UrdfFile) -> list[list[str]]:
    """Return the links of every rigid body that moves: its first link, then those fixed to it."""
    moved = [j.child for j in file.joints if j.moves and j.child in file.link_by_name]
    return [file.rigid_group(head) for head in dict.fromkeys([*file.roots, *moved])]


def inertia_matrix(link: Link) -> Array:
    """Return the (3, 3) inertia about the centre of mass in the link's axes [kg m^2]."""
    xx, yy, zz, xy, xz, yz = link.moments
    turn = rotation(link.inertia_rpy)
    matrix: Array = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    return matrix


def principal_moments(inertia: Array) -> Array:
    """Return the eigenvalues of a (3, 3) inertia, ascending; NaN where it is not finite."""
    if not np.all(np.isfinite(inertia)):
        return np.full(3, math.nan)
    return np.asarray(np.linalg.eigvalsh(inertia), dtype=float)


def body_inertia(file: UrdfFile, group: list[str]) -> Array:
    """Return the (3, 3) inertia [kg m^2] of a rigid group about its common centre of mass."""
    places = _placements(file, group)
    heavy = [(file.link_by_name[n], *places[n]) for n in group if file.link_by_name[n].mass]
    masses = np.array([link.mass for link, _, _ in heavy])
    centres = np.array([p + turn @ np.array(link.com) for link, turn, p in heavy])
    arms = centres - masses @ centres / masses.sum()
    total = np.zeros((3, 3))
    for (link, turn, _), mass, arm in zip(heavy, masses, arms, strict=True):
        total += turn @ inertia_matrix(link) @ turn.T
        total += mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return total


def _placements(file: UrdfFile, group: list[str]) -> dict[str, tuple[Array, Array]]:
    """Return rotation and position of every link of a rigid group in its first link's frame."""
    places = {group[0]: (np.eye(3), np.zeros(3))}
    for name in group:
        turn, position = places[name]
        for joint in file.joints_below[name]:
            if joint.moves or joint.child not in file.link_by_name or joint.child in places:
                continue
            numbers = joint.xyz + joint.rpy
            xyz, rpy = (joint.xyz, joint.rpy) if all(map(math.isfinite, numbers)) else ZEROS
            places[joint.child] = (turn @ rotation(rpy), position + turn @ np.array(xyz))
    return places


ZEROS = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
"""Place of a joint whose origin cannot be read."""
