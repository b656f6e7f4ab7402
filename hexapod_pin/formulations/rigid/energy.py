"""Energy and momentum in the robot's coordinates: 1/2 v.M v, the weight, centroidal momentum."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.conserved import ConservedQuantities

if TYPE_CHECKING:
    from hexapod_pin.formulations.rigid.model import RigidModel
    from hexapod_pin.robot.robot import State


def energy(model: RigidModel, state: State) -> ConservedQuantities:
    """Return energy and momentum of a state, by Pinocchio."""
    import pinocchio as pin

    kinetic = float(pin.computeKineticEnergy(model.model, model.data, state.q, state.v))
    momentum = pin.computeCentroidalMomentum(model.model, model.data, state.q, state.v)
    center = np.array(pin.centerOfMass(model.model, model.data, state.q))
    return ConservedQuantities(
        kinetic=kinetic,
        potential=-model.robot.total_mass * float(model.gravity @ center),
        momentum=np.array(momentum.linear),
        angular_momentum=np.array(momentum.angular),
        center_of_mass=center,
    )
