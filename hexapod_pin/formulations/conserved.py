"""Energy and momentum of a whole robot: what `energy` returns in every formulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array


@dataclass(frozen=True, eq=False)
class ConservedQuantities:
    """Quantities that free flight conserves or changes in a known way; world axes.

    Attributes:
        kinetic: kinetic energy [J].
        potential: energy of the weight, zero with the centre of mass at the origin [J].
        momentum: linear momentum [kg m/s]. Shape (3,).
        angular_momentum: about the centre of mass [kg m^2/s]. Shape (3,).
        center_of_mass: [m]. Shape (3,).
    """

    kinetic: float
    potential: float
    momentum: Array
    angular_momentum: Array
    center_of_mass: Array

    @property
    def total(self) -> float:
        """Kinetic and potential energy [J]."""
        return self.kinetic + self.potential
