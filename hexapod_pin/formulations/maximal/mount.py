"""How the root body stands in the world: free, fixed, or hanging from one of its points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.rotation import skew

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hexapod_pin.arrays import Array


@dataclass(frozen=True)
class Mount:
    """Constraints between root body and world: h = 0 (free), 3 (a point held) or 6 (fixed) rows.

    Attributes:
        held: h.
        point: the held point in the root link's frame [m].
        anchor: where it is held, world [m].
    """

    held: int = 0
    point: tuple[float, ...] = (0.0, 0.0, 0.0)
    anchor: tuple[float, ...] = (0.0, 0.0, 0.0)

    @classmethod
    def free(cls) -> Mount:
        """A floating root."""
        return cls()

    @classmethod
    def fixed(cls) -> Mount:
        """A root that stays where it starts, at rest."""
        return cls(6)

    @classmethod
    def at(cls, point: Sequence[float], anchor: Sequence[float]) -> Mount:
        """A root that turns: `point` in the root link's frame stays at `anchor`, world [m]."""
        return cls(3, tuple(map(float, point)), tuple(map(float, anchor)))

    def rows(self, arm: Array) -> Array:
        """Return D (h, 6) of the root; `arm` (3,) from its centre of mass to the point, world."""
        if self.held != 3:
            return np.eye(6)[: self.held]
        return np.concatenate([np.eye(3), -skew(arm)], axis=1)

    def violation(self, centre: Array, arm: Array) -> Array:
        """Return Phi (h,): a fixed root never leaves its place, it has no velocity."""
        if self.held != 3:
            return np.zeros(self.held)
        return np.asarray(centre + arm - np.array(self.anchor))

    def gamma(self, arm: Array, spin: Array) -> Array:
        """Return gamma (h,): -w x (w x s) of a held point."""
        if self.held != 3:
            return np.zeros(self.held)
        return np.asarray(-np.cross(spin, np.cross(spin, arm)))
