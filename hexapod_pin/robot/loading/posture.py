"""Joint angles by order or by name, and the angles a robot stands with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.robot.description.urdf_file import Joint
from hexapod_pin.robot.state import finite_vector

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
        given: what the user asks for; None for the file's own.

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
