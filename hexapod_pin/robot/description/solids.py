"""Masses and inertias come from homogeneous solids, or from what a URDF states for its links."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

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


def symmetric_matrix(moments: Sequence[float] | None) -> Array:
    """Return the (3, 3) inertia of (ixx, iyy, izz, ixy, ixz, iyz) [kg m^2]; zero for None."""
    xx, yy, zz, xy, xz, yz = moments or (0.0,) * 6
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inertia_matrix(link: Link) -> Array:
    """Return the (3, 3) inertia about the centre of mass in the link's axes [kg m^2]."""
    turn = rotation(link.inertia_rpy)
    matrix: Array = turn @ symmetric_matrix(link.moments) @ turn.T
    return matrix


def point_inertia(arm: Array) -> Array:
    """Return the (3, 3) inertia [m^2] of a unit point mass about a point it is an arm away from."""
    matrix: Array = arm @ arm * np.eye(3) - np.outer(arm, arm)
    return matrix


def principal_moments(inertia: Array) -> Array:
    """Return the eigenvalues of a (3, 3) inertia, ascending; NaN where it is not finite."""
    if not np.all(np.isfinite(inertia)):
        return np.full(3, math.nan)
    return np.asarray(np.linalg.eigvalsh(inertia), dtype=float)


def body_inertia(file: UrdfFile, group: list[str]) -> Array:
    """Return the (3, 3) inertia [kg m^2] of a rigid group about its common centre of mass."""
    places = placements(file, group[:1], rigid=True)
    heavy = [(file.link_by_name[n], *places[n]) for n in group if file.link_by_name[n].mass]
    masses = np.array([link.mass for link, _, _ in heavy])
    centres = np.array([p + turn @ np.array(link.com) for link, turn, p in heavy])
    arms = centres - masses @ centres / masses.sum()
    total = np.zeros((3, 3))
    for (link, turn, _), mass, arm in zip(heavy, masses, arms, strict=True):
        total += turn @ inertia_matrix(link) @ turn.T
        total += mass * point_inertia(arm)
    return total


def placements(
    file: UrdfFile, roots: Sequence[str], *, rigid: bool = False
) -> dict[str, tuple[Array, Array]]:
    """Return rotation (3, 3) and position (3,) [m] of links in the frame of the root above them.

    Args:
        file: a URDF; numbers of an origin that cannot be read count as zero.
        roots: links to begin with; a link below several of them is placed by the first.
        rigid: go through fixed joints alone; else all joints are at zero.
    """
    found: dict[str, tuple[Array, Array]] = {}
    for root in roots:
        found[root] = (np.eye(3), np.zeros(3))
        queue = [root]
        for name in queue:
            turn, place = found[name]
            for joint in file.joints_below.get(name, ()):
                child = joint.child
                if child in found or child not in file.link_by_name or (rigid and joint.moves):
                    continue
                xyz, rpy = finite(joint.xyz), finite(joint.rpy)
                found[child] = (turn @ rotation(rpy), place + turn @ np.array(xyz))
                queue.append(child)
    return found


def finite(values: tuple[float, ...]) -> tuple[float, ...]:
    """Return three numbers, zeros where one is none."""
    return values if all(map(math.isfinite, values)) else (0.0, 0.0, 0.0)
