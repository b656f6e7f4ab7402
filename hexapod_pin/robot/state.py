"""A state of a floating-base robot, checked before anything is computed from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import StateError
from hexapod_pin.immutable import Immutable

QUATERNION_NORM_TOLERANCE = 1e-6
"""Largest | |quaternion| - 1 | that is taken for round-off."""


@checked
@dataclass(frozen=True, eq=False)
class State(Immutable):
    """Configuration and velocity in Pinocchio's order; both arrays are read-only.

    Attributes:
        q: (nq,) base position in the world [m], base quaternion x, y, z, w, joint angles [rad].
        v: (nv,) base velocity in base axes: linear [m/s], angular [rad/s]; joint rates [rad/s].
    """

    q: Array
    v: Array

    @property
    def joints(self) -> Array:
        """(n_joints,) joint angles [rad]."""
        return self.q[7:]


def checked_state(q: ArrayLike, v: ArrayLike, n_joints: int) -> State:
    """Return the state, its quaternion renormalised from round-off.

    Args:
        q: (7 + n_joints,) configuration.
        v: (6 + n_joints,) velocity.
        n_joints: number of actuated joints.

    Raises:
        StateError: wrong shape, a value that is not finite, or a quaternion off unit norm by
            more than 1e-6 (Pinocchio would silently change gravity).
    """
    q_copy = finite_vector("q", q, 7 + n_joints)
    v_copy = finite_vector("v", v, 6 + n_joints)
    norm = float(np.linalg.norm(q_copy[3:7]))
    if abs(norm - 1) > QUATERNION_NORM_TOLERANCE:
        raise StateError(
            f"base quaternion q[3:7] (x, y, z, w) = {q_copy[3:7].tolist()}: its norm is {norm:.9g}"
            f" and must be 1 to {QUATERNION_NORM_TOLERANCE:g}; divide it by its norm."
        )
    q_copy[3:7] /= norm
    return State(read_only(q_copy), read_only(v_copy))


def finite_vector(name: str, values: ArrayLike, size: int) -> Array:
    """Return a float copy of a vector of this size; StateError names what does not fit."""
    array: NDArray[Any]
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise StateError(f"{name} is not an array of {size} numbers: {error}") from error
    if array.shape != (size,):
        raise StateError(f"{name} has shape {array.shape}: must be ({size},).")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise StateError(f"{name}[{bad[0]}] = {array[bad[0]]}: must be finite.")
    return array
