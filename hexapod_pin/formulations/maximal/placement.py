"""Everything at one state that follows from where the bodies are and how they move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.joint_vectors import AXIS, A, B, Carried
from hexapod_pin.formulations.maximal.rotation import rotations

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.motion import BodyState


@dataclass(frozen=True, eq=False)
class Placement:
    """Attitudes, inertias and joint vectors, world axes.

    Attributes:
        turn: (nb, 3, 3) body to world.
        inertia: (nb, 3, 3) about the centres of mass, world axes [kg m^2].
        mass: (nb, 6, 6) of each body, world axes.
        on_parent: vectors the parents carry: s_i, axis, a, b at zero angle.
        on_child: vectors the children carry: s_j, a_j, b_j.
        angle: (nj,) joint angles within half a turn [rad].
        rate: (nj,) [rad/s].
    """

    turn: Array
    inertia: Array
    mass: Array
    on_parent: Carried
    on_child: Carried
    angle: Array
    rate: Array


def placed(bodies: Bodies, vectors: tuple[Array, Array], state: BodyState) -> Placement:
    """Return the placement of a state; `vectors` as `local_vectors` gives them."""
    turn = rotations(state.quaternion)
    inertia = world_inertia(turn, bodies.inertia)
    spin = state.velocity[:, 3:]
    i = Carried(np.matmul(turn[bodies.parent], vectors[0]), spin[bodies.parent])
    j = Carried(np.matmul(turn[1:], vectors[1]), spin[1:])
    a = j.value[:, :, 1]
    angle = np.arctan2(_dot(a, i.value[:, :, B]), _dot(a, i.value[:, :, A]))
    rate = _dot(i.value[:, :, AXIS], j.spin - i.spin)
    return Placement(turn, inertia, spatial_mass(bodies.mass, inertia), i, j, angle, rate)


def world_inertia(turn: Array, inertia: Array) -> Array:
    """Return R I R' (nb, 3, 3)."""
    return np.asarray(np.matmul(np.matmul(turn, inertia), turn.transpose(0, 2, 1)))


def spatial_mass(mass: Array, inertia: Array) -> Array:
    """Return diag(m, m, m, I) (nb, 6, 6)."""
    found = np.zeros((len(mass), 6, 6))
    found[:, [0, 1, 2], [0, 1, 2]] = mass[:, None]
    found[:, 3:, 3:] = inertia
    return found


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ni,ni->n", a, b))
