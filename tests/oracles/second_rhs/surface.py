"""The ground under a sphere: plane, patches and shaking; written apart from the native core."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import Flat, Patch, PatchedGround, ShakingGround, Slope

STILL = np.zeros(3)


class Surface:
    """A plane that may have patches and move up and down.

    Attributes:
        normal: unit normal out of the ground, world axes. Shape (3,).
        patches: rectangles of other materials; the first counts.
    """

    def __init__(self, terrain: Any) -> None:
        """Read the terrain's parameters.

        Raises:
            ParameterError: a ground that is no plane.
        """
        self._amplitude, self._rate = 0.0, 0.0
        self.patches: tuple[Patch, ...] = ()
        if isinstance(terrain, ShakingGround):
            self._amplitude = terrain.amplitude
            self._rate = 2.0 * math.pi * terrain.frequency
            terrain = terrain.ground
        if isinstance(terrain, PatchedGround):
            self.patches, terrain = terrain.patches, terrain.ground
        if isinstance(terrain, Flat):
            self._point = np.array([0.0, 0.0, terrain.height])
            self.normal: Array = np.array([0.0, 0.0, 1.0])
        elif isinstance(terrain, Slope):
            across = np.array([-math.sin(terrain.heading), math.cos(terrain.heading), 0.0])
            cosine = math.cos(terrain.angle)
            uphill = np.array([across[1] * cosine, -across[0] * cosine, math.sin(terrain.angle)])
            self._point, self.normal = np.array(terrain.point), np.cross(uphill, across)
        else:
            raise ParameterError(
                "Scene.terrain", type(terrain).__name__, "Flat or Slope, patched or shaken or not",
                "The second right-hand side knows planes only.",
            )  # fmt: skip

    def gap(self, time: float, centre: Array, radius: float) -> float:
        """Return the distance of a sphere to the ground [m], negative where it penetrates."""
        depth = self._point - centre
        if self._amplitude:
            depth[2] += self._amplitude * math.sin(self._rate * time)
        return -float(self.normal @ depth) - radius

    def velocity(self, time: float) -> Array:
        """Return the ground's velocity [m/s], world axes. Shape (3,)."""
        if not self._amplitude:
            return STILL
        speed = self._amplitude * self._rate * math.cos(self._rate * time)
        return np.array([0.0, 0.0, speed])

    def insides(self, place: Array) -> tuple[float, ...]:
        """Return how far a place [m] lies within each patch; negative outside."""
        x, y = float(place[0]), float(place[1])
        return tuple(
            min(x - p.low[0], p.high[0] - x, y - p.low[1], p.high[1] - y) for p in self.patches
        )

    def factors(self, patch: int) -> tuple[float, float]:
        """Return the factors on friction and normal force of a patch; of none for -1."""
        if patch < 0:
            return 1.0, 1.0
        return self.patches[patch].friction, self.patches[patch].stiffness
