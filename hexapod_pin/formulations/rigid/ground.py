"""Rigid ground: a plane with Coulomb friction, on which S2's feet stick."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hexapod_pin.errors import ParameterError

UNIT_LENGTH_TOLERANCE = 1e-9
"""Largest | |normal| - 1 | of a unit normal [-]."""


@dataclass(frozen=True)
class RigidGround:
    """A plane that does not deform.

    Attributes:
        mu: coefficient of friction [-], against which sticking is checked; *assumed* by default.
        normal: unit normal, pointing up, world axes.
        point: a point of the plane [m].
    """

    mu: float = 0.7
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ParameterError: mu is negative or not finite, or the normal is no unit vector.
        """
        if not (math.isfinite(self.mu) and self.mu >= 0.0):
            raise ParameterError("RigidGround.mu", self.mu, "finite and not negative")
        if not abs(math.hypot(*self.normal) - 1.0) < UNIT_LENGTH_TOLERANCE:
            raise ParameterError("RigidGround.normal", self.normal, "of unit length")
