"""Sizes of a robot that rules compare with: where its links are, its span, its leg length."""

from __future__ import annotations

import math
from functools import cached_property
from statistics import median

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.solids import box_inertia, rod_inertia
from hexapod_pin.robot.description.urdf_file import Joint, Link, UrdfFile
from hexapod_pin.robot.description.urdf_inertia import rotation
from hexapod_pin.robot.mending.link_solids import LinkSolids, Solid
from hexapod_pin.robot.mending.rules import GRAVITY, MASS_PER_SPAN, SLENDERNESS, SPAN, TORQUE_FACTOR

SUPPORT_SHARE = 1.0 / 3.0
"""Share of the weight on one foot: a tripod."""

FOOT_DISTANCE = 0.5
"""Distance of a standing foot from its hip over the length of the stretched leg."""


class Measures:
    """What a file says of sizes, with every joint at zero; whatever it says twice or wrongly."""

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
        found: dict[str, tuple[Array, Array]] = {}
        for root in self.file.roots:
            found[root] = (np.eye(3), np.zeros(3))
            queue = [root]
            for name in queue:
                for joint in self.file.joints_below.get(name, ()):
                    if joint.child in found or joint.child not in self.file.link_by_name:
                        continue
                    turn, place = found[name]
                    xyz, rpy = finite(joint.xyz), finite(joint.rpy)
                    found[joint.child] = (turn @ rotation(rpy), place + turn @ np.array(xyz))
                    queue.append(joint.child)
        return found

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


def finite(values: tuple[float, ...]) -> tuple[float, ...]:
    """Return three numbers, zeros where one of them is none."""
    return values if all(map(math.isfinite, values)) else (0.0, 0.0, 0.0)


def two_digits(value: float) -> float:
    """Round to two significant digits."""
    return float(f"{value:.2g}")
