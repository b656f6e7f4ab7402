"""Constraints between the root body and the world: none, all six, or one point held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.rotation import skew

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hexapod_pin.arrays import Array

POINT_ROWS = 3
"""Rows that hold one point."""


@dataclass(frozen=True, eq=False)
class RootEquations:
    """The root's h constraints at one state.

    Attributes:
        violation: Phi [m]; a fixed root has no velocity and never leaves its place. Shape (h,).
        rate: Phi' [m/s, rad/s]. Shape (h,).
        rows: D. Shape (h, 6).
        gamma: [m/s^2]. Shape (h,).
    """

    violation: Array
    rate: Array
    rows: Array
    gamma: Array


@dataclass(frozen=True)
class RootConstraint:
    """How the root is held: h = 0 (free), 3 (a point held) or 6 (fixed) rows.

    Attributes:
        size: h.
        point: the held point in the root link's frame [m].
        anchor: where it is held, world [m].
    """

    size: int = 0
    point: tuple[float, ...] = (0.0, 0.0, 0.0)
    anchor: tuple[float, ...] = (0.0, 0.0, 0.0)

    @classmethod
    def free(cls) -> RootConstraint:
        """A floating root."""
        return cls()

    @classmethod
    def fixed(cls) -> RootConstraint:
        """A root that stays where it starts, at rest."""
        return cls(6)

    @classmethod
    def spherical(cls, point: Sequence[float], anchor: Sequence[float]) -> RootConstraint:
        """A root that turns: `point` in the root link's frame stays at `anchor`, world [m]."""
        return cls(POINT_ROWS, tuple(map(float, point)), tuple(map(float, anchor)))

    def equations(self, centre: Array, arm: Array, velocity: Array) -> RootEquations:
        """Return the constraints.

        Args:
            centre: of mass of the root, world [m]. Shape (3,).
            arm: from there to the point, world axes [m]. Shape (3,).
            velocity: of the root [m/s, rad/s], world axes. Shape (6,).
        """
        if self.size == POINT_ROWS:
            rows = np.concatenate([np.eye(3), -skew(arm)], axis=1)
            violation = centre + arm - np.array(self.anchor)
            gamma = -np.cross(velocity[3:], np.cross(velocity[3:], arm))
            return RootEquations(violation, rows @ velocity, rows, np.asarray(gamma))
        rows, none = np.eye(6)[: self.size], np.zeros(self.size)
        return RootEquations(none, rows @ velocity, rows, none)
