"""A height that is a polyline along one direction and the same sideways."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array


@dataclass(frozen=True)
class Polyline:
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
