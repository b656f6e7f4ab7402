"""A ground may be a plane, or change along one heading only: stairs, ramps, ledges and grooves.

`heading` is the direction of the profile in the horizontal plane, from x to y [rad]; places along
it are measured from the world's origin [m].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from hexapod_pin.ground.terrain.ground import (
    MAX_FACE_ANGLE_RAD,
    Ground,
    Heading,
    Height,
    Place,
    Size,
)
from hexapod_pin.immutable import Immutable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array


FaceAngle = Annotated[float, Field(gt=0.0, le=MAX_FACE_ANGLE_RAD)]


class Stairs(Ground):
    """Steps that go up along the heading; level before the first and after the last.

    Turn the heading round to walk down: `Stairs(..., start=-1.0, heading=pi)` puts the first step
    at x = 1 m, the top at its negative side.

    Attributes:
        rise: height of a step [m].
        run: depth of a tread [m].
        count: number of risers [-].
        start: place of the first riser along the heading [m].
        heading: [rad].
        height: z of the ground before the first step [m].
    """

    kind: Literal["stairs"] = "stairs"
    rise: Height
    run: Size
    count: Annotated[int, Field(ge=1, le=1000)]
    start: Place = 0.0
    heading: Heading = 0.0
    height: Place = 0.0

    def surface(self) -> Polyline:
        """Return the polyline of risers and treads."""
        places = [self.start + k * self.run for k in range(self.count)]
        levels = [self.height + k * self.rise for k in range(self.count + 1)]
        s = [place for place in places for _ in range(2)]
        z = [level for k in range(self.count) for level in (levels[k], levels[k + 1])]
        return Polyline(self.heading, tuple(s), tuple(z))


class Ramp(Ground):
    """Level ground, a slope, and level ground again.

    Attributes:
        angle: inclination [rad], positive: it rises along the heading. 60 degrees at most.
        run: level length of the slope [m].
        start: where the slope begins along the heading [m].
        heading: [rad].
        height: z of the ground before the slope [m].
    """

    kind: Literal["ramp"] = "ramp"
    angle: Annotated[float, Field(ge=-MAX_FACE_ANGLE_RAD, le=MAX_FACE_ANGLE_RAD)]
    run: Size
    start: Place = 0.0
    heading: Heading = 0.0
    height: Place = 0.0

    def surface(self) -> Polyline:
        """Return the polyline of the level parts and the slope."""
        top = self.height + self.run * math.tan(self.angle)
        return Polyline(self.heading, (self.start, self.start + self.run), (self.height, top))


class Ledge(Ground):
    """A shelf that ends at an edge; beyond it the ground lies at z = 0.

    Attributes:
        height: of the shelf [m].
        edge: place of the edge along the heading [m]; the shelf is before it.
        heading: [rad].
    """

    kind: Literal["ledge"] = "ledge"
    height: Height
    edge: Place = 0.0
    heading: Heading = 0.0

    def surface(self) -> Polyline:
        """Return the polyline of shelf, riser and ground."""
        return Polyline(self.heading, (self.edge, self.edge), (self.height, 0.0))


class Groove(Ground):
    """A V-shaped groove across the heading, in ground at z = 0.

    Attributes:
        angle_left: inclination of the face before the bottom, going down [rad], 60 degrees at most.
        angle_right: inclination of the face after the bottom, going up [rad].
        depth: of the bottom below the ground [m].
        bottom: place of the bottom along the heading [m].
        heading: [rad].
    """

    kind: Literal["groove"] = "groove"
    angle_left: FaceAngle
    angle_right: FaceAngle
    depth: Height = 0.05
    bottom: Place = 0.0
    heading: Heading = 0.0

    def surface(self) -> Polyline:
        """Return the polyline of the two faces."""
        left = self.bottom - self.depth / math.tan(self.angle_left)
        right = self.bottom + self.depth / math.tan(self.angle_right)
        return Polyline(self.heading, (left, self.bottom, right), (0.0, -self.depth, 0.0))


# Level and inclined planes.

Angle = Annotated[float, Field(ge=-MAX_FACE_ANGLE_RAD, le=MAX_FACE_ANGLE_RAD)]


@dataclass(frozen=True)
class Plane(Immutable):
    """The plane through `point` (3,) [m] with unit `normal` (3,), pointing up, world axes."""

    point: tuple[float, float, float]
    normal: tuple[float, float, float]

    def height_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return z [m] above x, y [m]."""
        (px, py, pz), (nx, ny, nz) = self.point, self.normal
        dx, dy = np.asarray(x, dtype=float) - px, np.asarray(y, dtype=float) - py
        return np.asarray(pz - (nx * dx + ny * dy) / nz)

    def normal_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return the normal (..., 3), the same everywhere."""
        shape = np.broadcast_shapes(np.shape(x), np.shape(y))
        return np.array(np.broadcast_to(self.normal, (*shape, 3)))

    def native(self) -> Any:
        """Return the native ground."""
        from hexapod_pin import native as _native

        return _native.plane(np.array(self.point), np.array(self.normal))


class Flat(Ground):
    """A horizontal plane.

    Attributes:
        height: z of the plane in the world [m].
    """

    kind: Literal["flat"] = "flat"
    height: Place = 0.0

    def surface(self) -> Plane:
        """Return the plane."""
        return _plane(0.0, 0.0, (0.0, 0.0, self.height))


class Slope(Ground):
    """An inclined plane.

    Attributes:
        angle: inclination [rad], 60 degrees at most; positive rises along the heading.
        heading: direction of the rise in the horizontal plane, from x to y [rad].
        point: a point of the plane [m], world axes.
    """

    kind: Literal["slope"] = "slope"
    angle: Angle
    heading: Heading = 0.0
    point: tuple[Place, Place, Place] = (0.0, 0.0, 0.0)

    def surface(self) -> Plane:
        """Return the plane."""
        return _plane(self.angle, self.heading, self.point)


@lru_cache(maxsize=64)
def _plane(angle: float, heading: float, point: tuple[float, float, float]) -> Plane:
    """Return the plane through a point that rises at an angle [rad] along a heading [rad]."""
    level = 0.0 - math.sin(angle)
    along = (math.cos(heading), math.sin(heading))
    return Plane(point, (level * along[0], level * along[1], math.cos(angle)))


# A height that is a polyline along one direction and the same sideways.


@dataclass(frozen=True)
class Polyline(Immutable):
    """Points of a polyline, level beyond its ends.

    Attributes:
        heading: direction of the polyline in the horizontal plane, from x to y [rad].
        s: (K,) distance along the heading from the world's origin [m], never falling; two equal
            ones are a vertical riser.
        z: (K,) height [m].
    """

    heading: float
    s: tuple[float, ...]
    z: tuple[float, ...]

    @property
    def along(self) -> Array:
        """Unit vector of the heading (2,)."""
        return np.array([math.cos(self.heading), math.sin(self.heading)])

    def distance(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return the distance along the heading [m] of x, y [m]."""
        return np.asarray(np.asarray(x) * self.along[0] + np.asarray(y) * self.along[1])

    def _faces(self, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array, Array]:
        """Return start, height at the start, and rise per length of the faces at x, y."""
        s, z = np.array(self.s), np.array(self.z)
        run, rise = np.diff(s), np.diff(z)
        grade = np.concatenate([[0.0], rise / np.where(run > 0.0, run, np.inf), [0.0]])
        s0, z0 = np.concatenate([s[:1], s]), np.concatenate([z[:1], z])
        face = np.searchsorted(s, self.distance(x, y), side="right")
        return s0[face], z0[face], grade[face]

    def height_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return z [m] above x, y [m]; at a riser that of its far side."""
        s0, z0, grade = self._faces(x, y)
        return np.asarray(z0 + grade * (self.distance(x, y) - s0))

    def normal_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return the unit normals (..., 3) of the faces; at a corner that of its far side."""
        grade = self._faces(x, y)[2]
        level = -grade[..., None] * self.along
        vector = np.concatenate([level, np.ones((*grade.shape, 1))], axis=-1)
        return np.asarray(vector / np.linalg.norm(vector, axis=-1, keepdims=True))

    def native(self) -> Any:
        """Return the native ground."""
        from hexapod_pin import native as _native

        return _native.profile(self.heading, list(self.s), list(self.z))
