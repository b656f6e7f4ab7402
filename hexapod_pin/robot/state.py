"""A state is a configuration and a velocity; joint angles may be given in order or by name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, StateError, UnknownNameError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.description.urdf_file import Joint

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


# Joint angles by order or by name, and the angles a robot stands with.

Posture = ArrayLike | Mapping[str, float]


def joint_angles(names: Sequence[str], default: Array, given: Posture) -> Array:
    """Return (n,) angles [rad] in the order of `names`.

    Args:
        names: joint names.
        default: (n,) angles of the joints that a mapping leaves out [rad].
        given: (n,) angles in order, or joint name -> angle.

    Raises:
        UnknownNameError: a joint that is not among `names`.
        StateError: wrong shape or a value that is not finite.
    """
    if not isinstance(given, Mapping):
        return finite_vector("posture", given, len(names))
    unknown = [name for name in given if name not in names]
    if unknown:
        raise UnknownNameError("joint", unknown[0], list(names))
    merged = [given.get(name, own) for name, own in zip(names, default, strict=True)]
    return finite_vector("posture", merged, len(names))


def plain_posture(given: Posture | None) -> dict[str, float] | list[float] | None:
    """Return a posture as plain numbers; None where it is none, or not one of finite numbers."""
    if given is None:
        return None
    if isinstance(given, Mapping):
        named = {str(name): float(angle) for name, angle in given.items()}
        return named if all(map(math.isfinite, named.values())) else None
    angles = np.asarray(given, dtype=float)
    return angles.tolist() if angles.ndim == 1 and np.isfinite(angles).all() else None


def standing_angles(
    joints: Sequence[Joint], own: Mapping[str, float], given: Posture | None
) -> tuple[Array, list[str]]:
    """Return the default posture and notes: given, the file's own, or zero moved into the limits.

    Args:
        joints: moved joints in order.
        own: the file's own angles by joint name [rad].
        given: angles of the user; None for the file's own.

    Raises:
        ParameterError: an angle outside its joint's limits.
    """
    names = [joint.name for joint in joints]
    limits = [(joint.limit("lower", 0.0), joint.limit("upper", 0.0)) for joint in joints]
    neutral = np.array([min(max(0.0, lower), upper) for lower, upper in limits])
    angles = joint_angles(names, neutral, own)
    if given is not None:
        angles = joint_angles(names, angles, given)
    notes = []
    for name, angle, (lower, upper) in zip(names, angles, limits, strict=True):
        if not lower <= angle <= upper:
            raise ParameterError(f"posture[{name}]", float(angle), f"from {lower} to {upper} rad")
        if angle != 0 and name not in own and given is None:
            notes.append(f"joint {name}: zero is outside its limits; stands at {angle:g} rad")
    return read_only(angles), notes
