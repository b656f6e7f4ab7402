"""The solids that a URDF draws for its links: volume, centre and inertia of a uniform body."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Protocol

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import HexapodError
from hexapod_pin.robot.description.solids import box_inertia, rod_inertia
from hexapod_pin.robot.description.urdf_file import Link, length, lengths, origin, triple
from hexapod_pin.robot.description.urdf_inertia import rotation
from hexapod_pin.robot.reading.mesh_file import read_mesh

FLAT = 1e-9
"""A hull thinner than this share of its largest edge has no volume."""


class MeshFinder(Protocol):
    """Finds the file that a mesh reference means; None where there is none."""

    def find(self, uri: str) -> Path | None:
        """Return the file."""
        ...

    def why(self, uri: str) -> str:
        """Return what was tried, and the way out."""
        ...


@dataclass(frozen=True, eq=False)
class Solid:
    """A uniform body of density 1 kg/m^3 in the link's frame.

    Attributes:
        volume: [m^3].
        centre: centre of volume [m]. Shape (3,).
        inertia: about the centre, for density 1, in the link's axes [m^5]. Shape (3, 3).
        low: lowest coordinates [m]. Shape (3,).
        high: highest coordinates [m]. Shape (3,).
    """

    volume: float
    centre: Array
    inertia: Array
    low: Array
    high: Array

    @property
    def extent(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(self.high - self.low))

    def moved(self, turn: Array, shift: Array) -> Solid:
        """Return the solid turned by `turn` (3, 3) and shifted by `shift` (3,) [m]."""
        corners = np.array(list(product(*zip(self.low, self.high, strict=True)))) @ turn.T + shift
        return Solid(
            self.volume, turn @ self.centre + shift, turn @ self.inertia @ turn.T,
            corners.min(axis=0), corners.max(axis=0),
        )  # fmt: skip

    def about(self, point: Array) -> Array:
        """Return the inertia about another point [m^5]. Shape (3, 3)."""
        arm = self.centre - point
        parallel: Array = self.volume * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        return self.inertia + parallel


def joined(solids: Sequence[Solid]) -> Solid | None:
    """Return several solids as one; None without any that has a volume."""
    full = [solid for solid in solids if solid.volume > 0.0]
    if not full:
        return None
    volume = math.fsum(solid.volume for solid in full)
    centre = sum((s.volume / volume * s.centre for s in full), np.zeros(3))
    return Solid(
        volume, centre, sum((solid.about(centre) for solid in full), np.zeros((3, 3))),
        np.min([solid.low for solid in full], axis=0),
        np.max([solid.high for solid in full], axis=0),
    )  # fmt: skip


class LinkSolids:
    """Solids of the links of a file; each mesh is read once."""

    def __init__(self, finder: MeshFinder | None) -> None:
        """Keep the finder; None leaves all meshes out."""
        self.finder = finder
        self._meshes: dict[tuple[str, str], Solid | None] = {}

    def of(self, link: Link) -> Solid | None:
        """Return what is drawn for a link, else what it collides with; None without a solid."""
        for tag in ("visual", "collision"):
            solid = joined(self.shapes(link, tag))
            if solid is not None:
                return solid
        return None

    def shapes(self, link: Link, tag: str) -> list[Solid]:
        """Return the solids of the <visual> or <collision> elements that can be read."""
        found = []
        for element in link.element.findall(tag):
            solid = self._geometry(element.find("geometry"))
            xyz, rpy = origin(element)
            if solid is not None and all(map(math.isfinite, xyz + rpy)):
                found.append(solid.moved(rotation(rpy), np.array(xyz)))
        return found

    def mesh(self, element: ET.Element) -> Solid | None:
        """Return the solid of a <mesh> in its own axes; None where it cannot be read."""
        key = (element.get("filename") or "", element.get("scale") or "1 1 1")
        if key not in self._meshes:
            self._meshes[key] = self._read(*key)
        return self._meshes[key]

    def _read(self, uri: str, scale: str) -> Solid | None:
        path = self.finder.find(uri) if self.finder is not None and uri else None
        factors = np.array(triple(scale))
        if path is None or not np.all(np.isfinite(factors)) or not np.all(factors):
            return None
        return mesh_solid(path, factors)

    def _geometry(self, geometry: ET.Element | None) -> Solid | None:
        for shape in geometry if geometry is not None else ():
            if shape.tag == "mesh":
                return self.mesh(shape)
            if shape.tag in PRIMITIVES:
                return PRIMITIVES[shape.tag](shape)
        return None


def _box(element: ET.Element) -> Solid | None:
    x, y, z = lengths(element.get("size"))
    if not (min(x, y, z) > 0.0 and math.isfinite(x + y + z)):
        return None
    half, volume = np.array([x, y, z]) / 2, x * y * z
    return Solid(volume, np.zeros(3), np.diag(box_inertia(volume, (x, y, z))), -half, half)


def _cylinder(element: ET.Element) -> Solid | None:
    radius, long = (length(element, name) for name in ("radius", "length"))
    if not (min(radius, long) > 0.0 and math.isfinite(radius + long)):
        return None
    volume, half = math.pi * radius**2 * long, np.array([radius, radius, long / 2])
    along, across, _ = rod_inertia(volume, long, radius)
    return Solid(volume, np.zeros(3), np.diag([across, across, along]), -half, half)


def _sphere(element: ET.Element) -> Solid | None:
    radius = length(element, "radius")
    if not (radius > 0.0 and math.isfinite(radius)):
        return None
    volume, half = 4 / 3 * math.pi * radius**3, np.full(3, radius)
    return Solid(volume, np.zeros(3), 0.4 * volume * radius**2 * np.eye(3), -half, half)


PRIMITIVES: dict[str, Callable[[ET.Element], Solid | None]] = {
    "box": _box, "cylinder": _cylinder, "sphere": _sphere,
}  # fmt: skip


def mesh_solid(path: Path, scale: Array) -> Solid | None:
    """Return the convex hull of a mesh as a solid; None where it cannot be read or is flat.

    The hull, because it is the same for open, inverted and doubled surfaces, and because the
    default density (`rules.DENSITY`) was found with hulls.

    Args:
        path: STL, DAE or OBJ file.
        scale: factors along its axes. Shape (3,).
    """
    from scipy.spatial import QhullError
    from trimesh.convex import convex_hull

    try:
        vertices = read_mesh(path, tuple(scale)).vertices
        with np.errstate(all="ignore"):  # a flat hull divides by its volume, 0
            hull = convex_hull(vertices)
            volume, inertia = float(hull.volume), np.array(hull.moment_inertia)
            centre = np.array(hull.center_mass)
    except (HexapodError, QhullError, ValueError):
        return None
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    edges = high - low
    if not volume > FLAT * float(edges.max()) ** 3 or not np.all(np.isfinite(inertia)):
        return None
    return Solid(volume, centre, inertia, low, high)
