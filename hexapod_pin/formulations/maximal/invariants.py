"""Energy and momentum of all bodies together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.placement import world_inertia
from hexapod_pin.formulations.maximal.rotation import rotations

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.motion import BodyState


@dataclass(frozen=True, eq=False)
class Invariants:
    """World axes.

    Attributes:
        kinetic: [J].
        potential: of the weight, zero with all centres of mass at the origin [J].
        momentum: (3,) [kg m/s].
        angular_momentum: (3,) about the centre of mass [kg m^2/s].
        center_of_mass: (3,) [m].
    """

    kinetic: float
    potential: float
    momentum: Array
    angular_momentum: Array
    center_of_mass: Array

    @property
    def energy(self) -> float:
        """Kinetic and potential [J]."""
        return self.kinetic + self.potential


def invariants(bodies: Bodies, state: BodyState, gravity: Array) -> Invariants:
    """Return energy and momentum; `gravity` (3,) [m/s^2]."""
    mass, linear, spin = bodies.mass, state.velocity[:, :3], state.velocity[:, 3:]
    own = np.matmul(world_inertia(rotations(state.quaternion), bodies.inertia), spin[:, :, None])
    turning = own[:, :, 0]
    center = mass @ state.position / mass.sum()
    arms = state.position - center
    return Invariants(
        kinetic=0.5 * float(mass @ (linear**2).sum(axis=1) + (spin * turning).sum()),
        potential=-float(mass.sum() * (gravity @ center)),
        momentum=mass @ linear,
        angular_momentum=(turning + np.cross(arms, mass[:, None] * linear)).sum(axis=0),
        center_of_mass=center,
    )
