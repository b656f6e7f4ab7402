"""Gaps and normals between spheres and the ground."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.ground.terrain import PatchedGround, Plane, Polyline, ShakingGround

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.ground.terrain import Ground

NO_CONTACT_GAP_M = 1e9
"""Gap of a contact that is nowhere near the ground [m]."""


class GroundQuery:
    """The ground under a fixed number of spheres.

    Planes are done here; stairs, ledges, grooves and height fields use the terrain's own search.

    Attributes:
        contacts_per_sphere: that a sphere can have at once.
    """

    def __init__(self, terrain: Ground) -> None:
        """Separate shaking and patches from the shape below."""
        shape: Any = terrain
        self._shaking = shape if isinstance(shape, ShakingGround) else None
        shape = shape.ground if isinstance(shape, ShakingGround) else shape
        self._patches = shape if isinstance(shape, PatchedGround) else None
        shape = shape.ground if isinstance(shape, PatchedGround) else shape
        surface = shape.surface()
        self._plane = surface if isinstance(surface, Plane) else None
        self._search = None if self._plane is not None else shape.native()
        self.contacts_per_sphere = 2 if isinstance(surface, Polyline) else 1

    def under(self, time: float, centers: Array, radii: Array) -> tuple[Array, Array]:
        """Return gaps (C,) [m] and unit normals (C, 3) of spheres (F, 3), (F,); C = F or 2 F."""
        if self._shaking is not None:
            centers = centers - (0.0, 0.0, float(self._shaking.lift_at(time)))
        if self._plane is not None:
            normal = np.array(self._plane.normal)
            gaps = (centers - self._plane.point) @ normal - radii
            return gaps, np.broadcast_to(normal, centers.shape)
        return self._searched(centers, radii)

    def velocity(self, time: float) -> Array:
        """Return the velocity of the ground (3,) [m/s], world axes."""
        if self._shaking is None:
            return np.zeros(3)
        rate = 2.0 * np.pi * self._shaking.frequency
        return np.array([0.0, 0.0, self._shaking.amplitude * rate * np.cos(rate * time)])

    def factors(self, centers: Array) -> Array:
        """Return factors on friction and stiffness (C, 2) [-] at places (C, 3)."""
        if self._patches is None:
            return np.ones((len(centers), 2))
        return self._patches.factors_at(centers[:, 0], centers[:, 1])

    def _searched(self, centers: Array, radii: Array) -> tuple[Array, Array]:
        gaps = np.full((len(centers), self.contacts_per_sphere), NO_CONTACT_GAP_M)
        normals = np.zeros((len(centers), self.contacts_per_sphere, 3))
        normals[:, :, 2] = 1.0
        search: Any = self._search
        for f, (center, radius) in enumerate(zip(centers, radii, strict=True)):
            for k, (gap, normal) in enumerate(search.contacts(center, float(radius))):
                gaps[f, k], normals[f, k] = gap, normal
        return gaps.ravel(), normals.reshape(-1, 3)
