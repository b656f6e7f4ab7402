"""The model of S1 eqs 1-3 has a state, joint constraints, and a linear system with multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.model_parts import Baumgarte, JointActuators, RootConstraint
from hexapod_pin.formulations.maximal.state import MaximalState, RunMemory
from hexapod_pin.robot.rotations import quaternion_products, rotations, skew, unit_quaternions

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.ground_contact import GroundContact
    from hexapod_pin.formulations.maximal.model_parts import RootEquations


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
        """Solve S1 eq. 1 for accelerations and multipliers, by elimination from leaves to root.

        Args:
            mass: mass matrices of the bodies, world axes. Shape (nb, 6, 6).
            force: f. Shape (nb, 6).
            d: the blocks of D.
            target: g of the joints. Shape (nj, 5).
            root_target: g of the root's constraints. Shape (h,).

        Returns:
            v' (nb, 6), lambda of the joints (nj, 5) and of the root (h,).
        """
        mass, force, bodies = mass.copy(), force.copy(), self.bodies
        done: list[tuple[Array, Array]] = []
        for level in bodies.levels[::-1]:
            free, reply = _eliminate(level, mass, force, d, target)
            share = np.matmul(d.on_parent[level].transpose(0, 2, 1), reply)
            total = bodies.joints_on_body[:, level] @ share.reshape(len(share), -1)
            mass += total.reshape(-1, 6, 7)[:, :, :6]
            force += total.reshape(-1, 6, 7)[:, :, 6]
            done.append((free, reply))
        rates, multipliers = np.empty_like(force), np.empty_like(target)
        rates[0], support = _solve_root(mass[0], force[0], d.root.rows, root_target)
        for level, (free, reply) in zip(bodies.levels, done[::-1], strict=True):
            above = rates[bodies.parent[level]][:, :, None]
            found = reply[:, :, 6:] - np.matmul(reply[:, :, :6], above)
            multipliers[level] = found[:, :, 0]
            below = free[:, :, ROWS_PER_JOINT:] + np.matmul(free[:, :, :ROWS_PER_JOINT], found)
            rates[level.start + 1 : level.stop + 1] = below[:, :, 0]
        return rates, multipliers, support

    def gaps(self, time: float, state: MaximalState) -> Array:
        """Return the gaps of all contacts (C,) [m], negative inside the ground."""
        if self.contact is None:
            return np.empty(0)
        return self.contact.gaps(time, state.position, rotations(state.quaternion))


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
    return quaternion_products(fixed, moved)


def _place_children(
    bodies: Bodies, level: slice, local: Array, rates: Array, state: MaximalState
) -> None:
    """Fill in the children of the joints of one level."""
    parent, child = bodies.parent[level], slice(level.start + 1, level.stop + 1)
    state.quaternion[child] = unit_quaternions(
        quaternion_products(state.quaternion[parent], local[level])
    )
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


# What follows from the bodies' positions and velocities at one state (S1 eqs 1-3).


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


# A revolute joint as five constraints between two bodies (S1 eqs 2-3).
#
#     Phi = [r_j + s_j - r_i - s_i;  d_i . a_j;  d_i . b_j],   Phi' = D v,   Phi'' = D v' - gamma
#
# Body i is the parent, body j the child; s_i, s_j lead from the centres of mass to the joint, d_i
# is the unit axis on body i, a_j and b_j are unit vectors across it on body j. All unit vectors:
# rows 1-3 are in m, rows 4-5 in rad. S1 prints gamma's first row with s where it is s': the dots
# are restored here, d/dt s = w x s.

ROWS_PER_JOINT = 5


@dataclass(frozen=True, eq=False)
class ConstraintEquations:
    """All constraints at one state.

    Attributes:
        violation: Phi of the joints [m, m, m, rad, rad]. Shape (nj, 5).
        rate: Phi' [m/s, rad/s]. Shape (nj, 5).
        on_parent: columns of D that belong to body i. Shape (nj, 5, 6).
        on_child: columns of D that belong to body j. Shape (nj, 5, 6).
        gamma: [m/s^2, rad/s^2]. Shape (nj, 5).
        root: the constraints between root and world.
    """

    violation: Array
    rate: Array
    on_parent: Array
    on_child: Array
    gamma: Array
    root: RootEquations

    @property
    def largest_violation(self) -> float:
        """Largest |Phi| of joints and root [m, rad]."""
        parts = (self.violation, self.root.violation)
        return max(float(np.abs(part).max(initial=0.0)) for part in parts)


def joint_constraints(
    parent: NDArray[np.intp], state: MaximalState, at: BodyKinematics, root: RootEquations
) -> ConstraintEquations:
    """Return Phi, Phi', D and gamma of all joints, beside those of the root."""
    position, velocity, i, j = state.position, state.velocity, at.on_parent, at.on_child
    tilt = np.matmul(i.value[:, None, :, AXIS], j.value[:, :, 1:])[:, 0]
    gap = position[1:] + j.value[:, :, JOINT_POINT] - position[parent] - i.value[:, :, JOINT_POINT]
    on_parent, on_child = jacobians(i, j)
    rate = np.matmul(on_child, velocity[1:, :, None])
    rate = rate + np.matmul(on_parent, velocity[parent][:, :, None])
    gamma = np.concatenate([gamma_row_1(i, j), gamma_rows_2_3(i, j)], axis=1)
    violation = np.concatenate([gap, tilt], axis=1)
    return ConstraintEquations(violation, rate[:, :, 0], on_parent, on_child, gamma, root)


def jacobians(i: BodyFixedVectors, j: BodyFixedVectors) -> tuple[Array, Array]:
    """Return D's columns of the parents and of the children (S1 eq. 2)."""
    on_parent, on_child = np.zeros((2, len(i.value), ROWS_PER_JOINT, 6))
    on_child[:, :3, :3] = np.eye(3)
    on_child[:, :3, 3:] = -skew(j.value[:, :, JOINT_POINT])
    on_parent[:, :3, :3] = -np.eye(3)
    on_parent[:, :3, 3:] = skew(i.value[:, :, JOINT_POINT])
    across = np.matmul(skew(i.value[:, :, AXIS]), j.value[:, :, 1:])  # d x a, d x b
    on_parent[:, 3:, 3:] = across.transpose(0, 2, 1)
    on_child[:, 3:, 3:] = -on_parent[:, 3:, 3:]
    return on_parent, on_child


def gamma_row_1(i: BodyFixedVectors, j: BodyFixedVectors) -> Array:
    """Return row 1 of gamma (nj, 3): -(s_i')~ w_i + (s_j')~ w_j (S1 eq. 3, dots restored)."""
    return np.asarray(i.second[:, :, JOINT_POINT] - j.second[:, :, JOINT_POINT])


def gamma_rows_2_3(i: BodyFixedVectors, j: BodyFixedVectors) -> Array:
    """Return rows 2-3 of gamma (nj, 2): -(d'' . a + 2 d' . a' + d . a''), without w' (S1 eq. 3)."""
    axis = [i.second[:, None, :, AXIS], 2.0 * i.rate[:, None, :, AXIS], i.value[:, None, :, AXIS]]
    normals = [j.value[:, :, 1:], j.rate[:, :, 1:], j.second[:, :, 1:]]
    found = np.matmul(np.concatenate(axis, axis=2), np.concatenate(normals, axis=1))
    return np.asarray(-found[:, 0])


# S1 eq. 1, M v' = f + D' lambda and D v' = g, on a tree of bodies: leaves to root and back.
#
# A leaf j on body i leaves S = D_j M_j^-1 D_j' (5 x 5) and from its own two equations
#
#     lambda = S^-1 (g - D_i v'_i - D_j M_j^-1 f_j),
#
# which adds D_i' S^-1 D_i to M_i (6 x 6) and D_i' S^-1 (g - D_j M_j^-1 f_j) to f_i. Joints of equal
# depth are done together, so six equal legs cost three batches. Nothing larger than 6 x 6 is
# solved.


def _eliminate(
    level: slice, mass: Array, force: Array, d: ConstraintEquations, target: Array
) -> tuple[Array, Array]:
    """Return M_j^-1 [D_j' f_j] (n, 6, 6) and S^-1 [D_i, g - D_j M_j^-1 f_j] (n, 5, 7)."""
    child = slice(level.start + 1, level.stop + 1)
    rows = d.on_child[level]
    right = np.concatenate([rows.transpose(0, 2, 1), force[child][:, :, None]], axis=2)
    free = np.linalg.solve(mass[child], right)
    answer = np.matmul(rows, free)
    rest = target[level][:, :, None] - answer[:, :, ROWS_PER_JOINT:]
    wide = np.concatenate([d.on_parent[level], rest], axis=2)
    reply = np.linalg.solve(answer[:, :, :ROWS_PER_JOINT], wide)
    return np.asarray(free), np.asarray(reply)


def _solve_root(mass: Array, force: Array, rows: Array, target: Array) -> tuple[Array, Array]:
    """Return the root's acceleration (6,) and the multipliers (h,) of its constraints."""
    if not len(rows):
        return np.asarray(np.linalg.solve(mass, force)), np.empty(0)
    free = np.linalg.solve(mass, np.column_stack([force, rows.T]))
    rate, across = free[:, 0], free[:, 1:]
    support = np.linalg.solve(rows @ across, target - rows @ rate)
    return np.asarray(rate + across @ support), np.asarray(support)


# Vectors of the joints that turn with a body, in world axes: what S1 eqs 2-3 are made of.

JOINT_POINT, AXIS, NORMAL_A, NORMAL_B = 0, 1, 2, 3
"""Columns of the parent's vectors; the child has its joint point, then a and b."""


@dataclass(frozen=True, eq=False)
class BodyFixedVectors:
    """Vectors fixed to one body of each joint.

    Attributes:
        value: world axes. Shape (nj, 3, k).
        spin: angular velocity w of the body, world axes [rad/s]. Shape (nj, 3).
    """

    value: Array
    spin: Array

    @cached_property
    def _spin_matrix(self) -> Array:
        return skew(self.spin)

    @cached_property
    def rate(self) -> Array:
        """First time derivatives, w x s."""
        return np.asarray(np.matmul(self._spin_matrix, self.value))

    @cached_property
    def second(self) -> Array:
        """Part of the second time derivatives without w', w x (w x s)."""
        return np.asarray(np.matmul(self._spin_matrix, self.rate))


def local_vectors(bodies: Bodies) -> tuple[Array, Array]:
    """Return the vectors in their bodies' axes.

    The parent has s_i, the axis and, for the angle, a and b at zero angle (nj, 3, 4); the child
    has s_j, a_j and b_j (nj, 3, 3).
    """
    a, b = bodies.across
    on_parent = [np.einsum("nij,nj->ni", bodies.attitude, x) for x in (bodies.axis, a, b)]
    return (
        np.stack([bodies.place, *on_parent], axis=-1),
        np.stack([bodies.child_place, a, b], axis=-1),
    )
