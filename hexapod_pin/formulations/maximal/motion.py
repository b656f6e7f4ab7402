"""The state of all bodies, and its way from and to a base pose with joint angles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal import rotation

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies


@dataclass(frozen=True, eq=False)
class BodyState:
    """Positions and velocities of nb bodies.

    Attributes:
        position: (nb, 3) centres of mass, world [m].
        quaternion: (nb, 4) x, y, z, w, body to world.
        velocity: (nb, 6) of the centre of mass [m/s], then angular [rad/s], world axes.
    """

    position: Array
    quaternion: Array
    velocity: Array

    def flat(self) -> Array:
        """Return all numbers in one vector (13 nb,)."""
        parts = (self.position, self.quaternion, self.velocity)
        return np.concatenate([part.ravel() for part in parts])

    @classmethod
    def from_flat(cls, y: Array) -> BodyState:
        """Return the state in a vector (13 nb,), as views of it."""
        n = len(y) // 13
        return cls(
            y[: 3 * n].reshape(n, 3), y[3 * n : 7 * n].reshape(n, 4), y[7 * n :].reshape(n, 6)
        )


def assembled(bodies: Bodies, q: Array, v: Array) -> BodyState:
    """Return the state of all bodies that a base pose and joint angles describe.

    Args:
        bodies: the bodies.
        q: (7 + nj,) root link's origin in the world [m], its quaternion x, y, z, w, joint angles
            in the order of `bodies.joint_names` [rad].
        v: (6 + nj,) root link's velocity at its origin in its own axes [m/s], [rad/s]; joint rates
            [rad/s].
    """
    n = len(bodies.mass)
    state = BodyState(np.empty((n, 3)), np.empty((n, 4)), np.empty((n, 6)))
    state.quaternion[0] = q[3:7] / np.linalg.norm(q[3:7])
    turn = rotation.rotations(state.quaternion[:1])[0]
    spin, arm = turn @ v[3:6], -turn @ bodies.root_origin
    state.position[0] = q[:3] + arm
    state.velocity[0, :3] = turn @ v[:3] + np.cross(spin, arm)
    state.velocity[0, 3:] = spin
    local = _joint_quaternions(bodies, q[7:])
    for level in bodies.levels:
        _hang(bodies, level, local, v[6:], state)
    return state


def _joint_quaternions(bodies: Bodies, angles: Array) -> Array:
    """Return the attitudes (nj, 4) of the children in their parents' axes."""
    if not len(angles):
        return np.empty((0, 4))
    fixed = np.array([rotation.from_matrix(m) for m in bodies.attitude])
    moved = np.column_stack([np.sin(angles / 2)[:, None] * bodies.axis, np.cos(angles / 2)])
    return rotation.product(fixed, moved)


def _hang(bodies: Bodies, level: slice, local: Array, rates: Array, state: BodyState) -> None:
    """Place the children of the joints of one level."""
    parent, child = bodies.parent[level], slice(level.start + 1, level.stop + 1)
    state.quaternion[child] = rotation.normalised(
        rotation.product(state.quaternion[parent], local[level])
    )
    up = rotation.rotations(state.quaternion[parent])
    down = rotation.rotations(state.quaternion[child])
    s_i = np.einsum("nij,nj->ni", up, bodies.place[level])
    s_j = np.einsum("nij,nj->ni", down, bodies.child_place[level])
    axis = np.einsum("nij,nj->ni", down, bodies.axis[level])
    above = state.velocity[parent]
    state.position[child] = state.position[parent] + s_i - s_j
    spin = above[:, 3:] + rates[level][:, None] * axis
    state.velocity[child, 3:] = spin
    at_joint = above[:, :3] + np.cross(above[:, 3:], s_i)
    state.velocity[child, :3] = at_joint - np.cross(spin, s_j)
