"""Energy and momentum of all bodies together, each body with its own velocity (S1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.conserved import ConservedQuantities
from hexapod_pin.formulations.maximal.kinematics import world_inertia
from hexapod_pin.formulations.maximal.rotation import rotations

if TYPE_CHECKING:
    from hexapod_pin.formulations.maximal.model import MaximalModel
    from hexapod_pin.formulations.maximal.state import MaximalState


def energy(model: MaximalModel, state: MaximalState) -> ConservedQuantities:
    """Return energy and momentum of a state."""
    bodies, linear, spin = model.bodies, state.velocity[:, :3], state.velocity[:, 3:]
    inertia = world_inertia(rotations(state.quaternion), bodies.inertia)
    own_momentum = np.matmul(inertia, spin[:, :, None])[:, :, 0]
    mass, total = bodies.mass, bodies.mass.sum()
    center = mass @ state.position / total
    about_center = np.cross(state.position - center, mass[:, None] * linear)
    return ConservedQuantities(
        kinetic=0.5 * float(mass @ (linear**2).sum(axis=1) + (spin * own_momentum).sum()),
        potential=-float(total * (model.gravity @ center)),
        momentum=mass @ linear,
        angular_momentum=(own_momentum + about_center).sum(axis=0),
        center_of_mass=center,
    )
