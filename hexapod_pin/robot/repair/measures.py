"""Rules compare with the sizes of a robot: positions and solids of links, span and leg length."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from statistics import median
from typing import Protocol

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import HexapodError
from hexapod_pin.robot.description.solids import (
    box_inertia,
    finite,
    placements,
    point_inertia,
    rod_inertia,
)
from hexapod_pin.robot.description.urdf_file import (
    Joint,
    Link,
    UrdfFile,
    length,
    lengths,
    origin,
    triple,
)
from hexapod_pin.robot.reading.mesh_file import read_mesh
from hexapod_pin.robot.repair.rules import GRAVITY, MASS_PER_SPAN, SLENDERNESS, SPAN, TORQUE_FACTOR
from hexapod_pin.robot.rotations import rotation

SUPPORT_SHARE = 1.0 / 3.0
"""Share of the weight on one foot: a tripod."""

FOOT_DISTANCE = 0.5
"""Distance of a standing foot from its hip over the length of the stretched leg."""


class Measures:
    """Sizes of a robot from its file, with every joint at zero; the file may have any fault."""

    def __init__(self, file: UrdfFile, solids: LinkSolids) -> None:
        """Keep the file and its solids."""
        self.file, self.solids = file, solids
        self._solid: dict[str, Solid | None] = {}
        self._reach: dict[str, float] = {}

    def solid(self, link: Link) -> Solid | None:
        """Return the solid of a link in its own frame."""
        if link.name not in self._solid:
            self._solid[link.name] = self.solids.of(link)
        return self._solid[link.name]

    @cached_property
    def places(self) -> dict[str, tuple[Array, Array]]:
        """Rotation (3, 3) and position (3,) [m] of every link that a root leads to."""
        return placements(self.file, self.file.roots)

    @cached_property
    def span(self) -> float:
        """Diagonal of the box around the origins of all moved joints [m]; 0 without any."""
        moved = [j.child for j in self.file.joints if j.moves and j.child in self.places]
        points = np.array([self.places[name][1] for name in moved]).reshape(-1, 3)
        return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0

    @property
    def size(self) -> float:
        """Span of the joints, else the diagonal of the largest solid [m]."""
        solids = [self.solid(link) for link in self.file.links]
        return self.span or max((solid.extent for solid in solids if solid), default=0.0)

    @cached_property
    def total_mass(self) -> float:
        """Sum of all masses that are numbers [kg]."""
        masses = [link.mass or 0.0 for link in self.file.links]
        return math.fsum(mass for mass in masses if math.isfinite(mass))

    @property
    def plausible_size(self) -> bool:
        """Whether the joints, if any moves, span what a walking machine can."""
        return self.span == 0.0 or SPAN[0] <= self.span <= SPAN[1]

    @property
    def plausible_mass(self) -> bool:
        """Whether the total mass fits the span of the joints."""
        low, high = (bound * self.span**3 for bound in MASS_PER_SPAN)
        return self.span > 0.0 and low <= self.total_mass <= high

    @cached_property
    def chains(self) -> tuple[tuple[Joint, ...], ...]:
        """Moved joints of every path from a root to an end, beyond the last branching."""
        return tuple(self._chain(name) for name in self.places if self._is_end(name))

    @cached_property
    def leg_length(self) -> float:
        """Median length of the chains with most joints, stretched, from the first joint [m]."""
        lengths = [self._length(chain) for chain in self.chains if len(chain) >= 2]
        lengths = lengths or [self._length(chain) for chain in self.chains if chain]
        return median(lengths) if lengths else 0.0

    @property
    def holding_torque(self) -> float:
        """Torque that holds a third of the weight at half the leg's length [N m]."""
        weight = GRAVITY * self.total_mass
        return SUPPORT_SHARE * weight * FOOT_DISTANCE * self.leg_length

    @property
    def assumed_effort(self) -> float:
        """Torque limit where none is given, to two digits [N m]."""
        return two_digits(TORQUE_FACTOR * self.holding_torque)

    def reach(self, link: Link) -> float:
        """Distance from a link's origin to its farthest joint below [m]; 0 without any."""
        if link.name not in self._reach:
            joints = self.file.joints_below.get(link.name, ())
            lengths = [math.hypot(*finite(joint.xyz)) for joint in joints]
            self._reach[link.name] = max(lengths, default=0.0)
        return self._reach[link.name]

    def body(self, link: Link) -> Solid | None:
        """Return the solid of a link, else one around the joints below it; None without any."""
        solid = self.solid(link)
        if solid is not None:
            return solid
        joints = self.file.joints_below.get(link.name, ())
        points = np.array([finite(joint.xyz) for joint in joints if joint.moves]).reshape(-1, 3)
        if len(points) > 2:
            return _plate(points)
        far = max(points, key=np.linalg.norm, default=np.zeros(3))
        return _rod(far) if np.linalg.norm(far) > 0.0 else None

    def _is_end(self, name: str) -> bool:
        return name in self._movers and not self.file.moved_joints_below(name)

    @cached_property
    def _parents(self) -> dict[str, Joint]:
        return {j.child: j for j in self.file.joints}

    @cached_property
    def _movers(self) -> dict[str, Joint]:
        return {j.child: j for j in self.file.joints if j.moves}

    def _chain(self, end: str) -> tuple[Joint, ...]:
        chain: list[Joint] = []
        name, seen = end, {end}
        while name in self._parents:
            joint = self._parents[name]
            name = joint.parent
            if chain and joint.moves and self.file.branches_at(name):
                return (joint, *chain)
            chain = [joint, *chain] if joint.moves else chain
            if name in seen:
                break
            seen.add(name)
        return tuple(chain)

    def _length(self, chain: tuple[Joint, ...]) -> float:
        """Distances between the joints, and from the last one to the end of its solid."""
        places = [self.places[joint.child][1] for joint in chain if joint.child in self.places]
        between = sum(
            float(np.linalg.norm(b - a)) for a, b in zip(places, places[1:], strict=False)
        )
        ends = [self._end(name) for name in self.file.rigid_group(chain[-1].child)]
        return between + max((float(np.linalg.norm(e - places[-1])) for e in ends), default=0.0)

    def _end(self, name: str) -> Array:
        """Return the farthest point of a link's box from its origin, in the root's frame."""
        turn, place = self.places.get(name, (np.eye(3), np.zeros(3)))
        solid = self.solid(self.file.link_by_name[name])
        if solid is None:
            return place
        far = np.where(np.abs(solid.high) > np.abs(solid.low), solid.high, solid.low)
        axis = int(np.argmax(np.abs(far)))
        point: Array = place + turn @ (np.eye(3)[axis] * far[axis])
        return point


def _plate(points: Array) -> Solid | None:
    """Return a box around the joints of a trunk; points (n, 3) [m]."""
    low, high = points.min(axis=0), points.max(axis=0)
    edges = high - low
    least = 2.0 * SLENDERNESS * float(np.sort(edges)[1])
    if least <= 0.0:
        return _rod(points[int(np.argmax(np.linalg.norm(points, axis=1)))])
    x, y, z = (max(float(edge), least) for edge in edges)
    half, centre, volume = np.array([x, y, z]) / 2, (low + high) / 2, x * y * z
    inertia = np.diag(box_inertia(volume, (x, y, z)))
    return Solid(volume, centre, inertia, centre - half, centre + half)


def _rod(end: Array) -> Solid | None:
    """Return a rod from the origin to `end` (3,) [m]."""
    length = float(np.linalg.norm(end))
    if length <= 0.0:
        return None
    radius, along = SLENDERNESS * length, end / length
    volume = math.pi * radius**2 * length
    spin, across, _ = rod_inertia(volume, length, radius)
    inertia = across * np.eye(3) + (spin - across) * np.outer(along, along)
    return Solid(volume, end / 2, inertia, np.minimum(end, 0.0), np.maximum(end, 0.0))


def two_digits(value: float) -> float:
    """Round to two significant digits."""
    return float(f"{value:.2g}")


# The solids that a URDF draws for its links: volume, centre and inertia of a uniform body.

FLAT = 1e-9
"""A hull thinner than this share of its largest edge has no volume."""


class MeshFinder(Protocol):
    """Finds the file that a mesh reference means; None where there is none."""

    def find(self, uri: str) -> Path | None:
        """Return the file."""
        ...

    def why(self, uri: str) -> str:
        """Return what was tried, and a remedy."""
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
        return self.inertia + self.volume * point_inertia(arm)


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
