"""The parts of S1 eq. 1: bodies, joints, actuators, ground contact, stabilisation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.actuators import JointActuators
from hexapod_pin.formulations.maximal.baumgarte import Baumgarte
from hexapod_pin.formulations.maximal.constraints import ConstraintEquations, joint_constraints
from hexapod_pin.formulations.maximal.joint_vectors import local_vectors
from hexapod_pin.formulations.maximal.kinematics import BodyKinematics, kinematics
from hexapod_pin.formulations.maximal.kkt import TreeElimination
from hexapod_pin.formulations.maximal.root_constraint import RootConstraint
from hexapod_pin.formulations.maximal.rotation import rotations

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.ground_contact import GroundContact
    from hexapod_pin.formulations.maximal.state import MaximalState


class MaximalModel:
    """Bodies, their joints and what acts on them.

    Attributes:
        bodies: the bodies.
        actuators: at the joints.
        contact: of the feet with the ground; None in empty space.
        gravity: [m/s^2], world axes. Shape (3,).
        baumgarte: stabilisation.
        root: constraint of the root.
    """

    def __init__(
        self,
        bodies: Bodies,
        *,
        actuators: JointActuators | None = None,
        contact: GroundContact | None = None,
        gravity: Sequence[float] = (0.0, 0.0, -9.81),
        baumgarte: Baumgarte | None = None,
        root: RootConstraint | None = None,
    ) -> None:
        """Put the parts together; by default limp joints, empty space, a free root."""
        self.bodies, self.contact = bodies, contact
        self.actuators = actuators or JointActuators.uniform(bodies)
        self.gravity = np.array(gravity, dtype=float)
        self.baumgarte = baumgarte or Baumgarte.off()
        self.root = root or RootConstraint.free()
        self._elimination = TreeElimination(bodies)
        self._vectors = local_vectors(bodies)
        self._root_point = np.array(self.root.point) + bodies.root_origin

    @property
    def contact_count(self) -> int:
        """C, the number of contacts."""
        return 0 if self.contact is None else self.contact.count

    @property
    def has_bristles(self) -> bool:
        """Whether the friction law has bristles of its own state."""
        return self.contact is not None and self.contact.has_bristles

    def kinematics(self, state: MaximalState) -> BodyKinematics:
        """Return attitudes, inertias and joint vectors at a state."""
        return kinematics(self.bodies, self._vectors, state)

    def constraints(self, state: MaximalState, at: BodyKinematics) -> ConstraintEquations:
        """Return the constraints of joints and root."""
        arm = at.rotation[0] @ self._root_point
        root = self.root.equations(state.position[0], arm, state.velocity[0])
        return joint_constraints(self.bodies.parent, state, at, root)

    def solve_kkt(
        self, mass: Array, force: Array, d: ConstraintEquations, target: Array, root_target: Array
    ) -> tuple[Array, Array, Array]:
        """Solve S1 eq. 1 for accelerations and multipliers: see `TreeElimination`."""
        return self._elimination.solve_kkt(mass, force, d, target, root_target)

    def gaps(self, time: float, state: MaximalState) -> Array:
        """Return the gaps of all contacts (C,) [m], negative inside the ground."""
        if self.contact is None:
            return np.empty(0)
        return self.contact.gaps(time, state.position, rotations(state.quaternion))
