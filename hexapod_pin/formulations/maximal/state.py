"""State of the maximal formulation (S1): position, quaternion and velocity of every body."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.contact_memory import RunMemory
from hexapod_pin.formulations.maximal.rotation import normalised, product, rotations

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.model import MaximalModel


@dataclass(frozen=True, eq=False)
class MaximalState:
    """State of nb bodies and their C contacts.

    Attributes:
        position: centres of mass, world [m]. Shape (nb, 3).
        quaternion: x, y, z, w, body to world. Shape (nb, 4).
        velocity: of the centre of mass [m/s], then angular [rad/s], world axes. Shape (nb, 6).
        bristles: stretch of the stick-slip bristles [m], world axes; None without. Shape (C, 3).
        memory: updated at accepted states only; None: contacts that were never closed.
    """

    position: Array
    quaternion: Array
    velocity: Array
    bristles: Array | None = None
    memory: RunMemory | None = None

    def flat(self) -> Array:
        """Return the integrated numbers in one vector, 13 nb + 3 C with bristles."""
        parts = [self.position, self.quaternion, self.velocity]
        if self.bristles is not None:
            parts.append(self.bristles)
        return np.concatenate([part.ravel() for part in parts])

    def with_flat(self, y: Array) -> MaximalState:
        """Return the state with the numbers of a flat vector, as views of it, and this memory."""
        n = len(self.position)
        return MaximalState(
            y[: 3 * n].reshape(n, 3),
            y[3 * n : 7 * n].reshape(n, 4),
            y[7 * n : 13 * n].reshape(n, 6),
            None if self.bristles is None else y[13 * n :].reshape(-1, 3),
            self.memory,
        )

    def with_unit_quaternions(self) -> MaximalState:
        """Return the state with quaternions of unit length."""
        return replace(self, quaternion=normalised(self.quaternion))


def initial_state(model: MaximalModel, q: ArrayLike, v: ArrayLike) -> MaximalState:
    """Return the state of all bodies that a base pose and joint angles describe.

    Args:
        model: the model.
        q: root link's origin in the world [m], its quaternion x, y, z, w, joint angles in the
            order of `bodies.joint_names` [rad]. Shape (7 + nj,).
        v: root link's velocity at its origin in its own axes [m/s, rad/s], joint rates [rad/s].
            Shape (6 + nj,).
    """
    q, v, bodies = np.array(q, dtype=float), np.array(v, dtype=float), model.bodies
    n = len(bodies.mass)
    state = MaximalState(
        np.empty((n, 3)), np.empty((n, 4)), np.empty((n, 6)),
        bristles=np.zeros((model.contact_count, 3)) if model.has_bristles else None,
        memory=RunMemory.fresh(q[7:], model.contact_count),
    )  # fmt: skip
    state.quaternion[0] = q[3:7] / np.linalg.norm(q[3:7])
    rotation = rotations(state.quaternion[:1])[0]
    spin, arm = rotation @ v[3:6], -rotation @ bodies.root_origin
    state.position[0] = q[:3] + arm
    state.velocity[0, :3] = rotation @ v[:3] + np.cross(spin, arm)
    state.velocity[0, 3:] = spin
    local = _joint_quaternions(bodies, q[7:])
    for level in bodies.levels:
        _place_children(bodies, level, local, v[6:], state)
    return state


def _joint_quaternions(bodies: Bodies, angles: Array) -> Array:
    """Return the attitudes (nj, 4) of the children in their parents' axes."""
    from scipy.spatial.transform import Rotation

    if not len(angles):
        return np.empty((0, 4))
    fixed = Rotation.from_matrix(bodies.attitude).as_quat()
    moved = np.column_stack([np.sin(angles / 2)[:, None] * bodies.axis, np.cos(angles / 2)])
    return product(fixed, moved)


def _place_children(
    bodies: Bodies, level: slice, local: Array, rates: Array, state: MaximalState
) -> None:
    """Fill in the children of the joints of one level."""
    parent, child = bodies.parent[level], slice(level.start + 1, level.stop + 1)
    state.quaternion[child] = normalised(product(state.quaternion[parent], local[level]))
    on_parent, on_child = rotations(state.quaternion[parent]), rotations(state.quaternion[child])
    s_i = np.einsum("nij,nj->ni", on_parent, bodies.place[level])
    s_j = np.einsum("nij,nj->ni", on_child, bodies.child_place[level])
    axis = np.einsum("nij,nj->ni", on_child, bodies.axis[level])
    above = state.velocity[parent]
    state.position[child] = state.position[parent] + s_i - s_j
    spin = above[:, 3:] + rates[level][:, None] * axis
    state.velocity[child, 3:] = spin
    at_joint = above[:, :3] + np.cross(above[:, 3:], s_i)
    state.velocity[child, :3] = at_joint - np.cross(spin, s_j)
