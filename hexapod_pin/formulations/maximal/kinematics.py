"""What follows from the bodies' positions and velocities at one state (S1 eqs 1-3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.joint_vectors import (
    AXIS,
    NORMAL_A,
    NORMAL_B,
    BodyFixedVectors,
)
from hexapod_pin.formulations.maximal.rotation import rotations

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.state import MaximalState


@dataclass(frozen=True, eq=False)
class BodyKinematics:
    """Attitudes, inertias and joint vectors, world axes.

    Attributes:
        rotation: body to world. Shape (nb, 3, 3).
        inertia: about the centres of mass, world axes [kg m^2]. Shape (nb, 3, 3).
        mass: diag(m, m, m, I) of each body, world axes. Shape (nb, 6, 6).
        on_parent: vectors fixed to the parents: s_i, axis, a, b at zero angle.
        on_child: vectors fixed to the children: s_j, a_j, b_j.
        angle: joint angles within half a turn [rad]. Shape (nj,).
        rate: [rad/s]. Shape (nj,).
    """

    rotation: Array
    inertia: Array
    mass: Array
    on_parent: BodyFixedVectors
    on_child: BodyFixedVectors
    angle: Array
    rate: Array


def kinematics(bodies: Bodies, vectors: tuple[Array, Array], state: MaximalState) -> BodyKinematics:
    """Return the kinematics of a state; `vectors` as `local_vectors` gives them."""
    rotation = rotations(state.quaternion)
    inertia = world_inertia(rotation, bodies.inertia)
    spin, parent = state.velocity[:, 3:], bodies.parent
    i = BodyFixedVectors(np.matmul(rotation[parent], vectors[0]), spin[parent])
    j = BodyFixedVectors(np.matmul(rotation[1:], vectors[1]), spin[1:])
    a = j.value[:, :, 1]
    angle = np.arctan2(_dot(a, i.value[:, :, NORMAL_B]), _dot(a, i.value[:, :, NORMAL_A]))
    rate = _dot(i.value[:, :, AXIS], j.spin - i.spin)
    return BodyKinematics(rotation, inertia, _mass(bodies.mass, inertia), i, j, angle, rate)


def world_inertia(rotation: Array, inertia: Array) -> Array:
    """Return R I R' (nb, 3, 3)."""
    return np.asarray(np.matmul(np.matmul(rotation, inertia), rotation.transpose(0, 2, 1)))


def _mass(mass: Array, inertia: Array) -> Array:
    """Return diag(m, m, m, I) (nb, 6, 6)."""
    found = np.zeros((len(mass), 6, 6))
    found[:, [0, 1, 2], [0, 1, 2]] = mass[:, None]
    found[:, 3:, 3:] = inertia
    return found


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ni,ni->n", a, b))
