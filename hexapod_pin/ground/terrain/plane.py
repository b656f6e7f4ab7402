"""Level and inclined planes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from hexapod_pin.ground.terrain.ground import MAX_FACE_ANGLE_RAD, Ground, Heading, Place

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array

Angle = Annotated[float, Field(ge=-MAX_FACE_ANGLE_RAD, le=MAX_FACE_ANGLE_RAD)]


@dataclass(frozen=True)
class Plane:
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
        return Plane((0.0, 0.0, self.height), (0.0, 0.0, 1.0))


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
        level = -math.sin(self.angle)
        along = (math.cos(self.heading), math.sin(self.heading))
        return Plane(self.point, (level * along[0], level * along[1], math.cos(self.angle)))
