"""How far two runs are apart: all positions, or the trunk alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array


@dataclass(frozen=True)
class PositionError:
    """The largest differences over the samples.

    Attributes:
        q: of any position: base [m], turn of the trunk [rad], joints [rad].
        trunk: of the trunk's place, as a length [m].
    """

    q: float
    trunk: float

    @classmethod
    def between(cls, found: Array, wanted: Array) -> PositionError:
        """Compare configurations sample by sample.

        Args:
            found: (T, 7 + n) base position, quaternion x y z w, joints [m, -, rad].
            wanted: the same of the reference.
        """
        place = found[:, :3] - wanted[:, :3]
        joints = np.abs(found[:, 7:] - wanted[:, 7:])
        largest = max(
            float(np.abs(place).max()),
            float(turn(found[:, 3:7], wanted[:, 3:7]).max()),
            float(joints.max(initial=0.0)),
        )
        return cls(largest, trunk_error(found[:, :3], wanted[:, :3]))


def trunk_error(found: Array, wanted: Array) -> float:
    """Return the largest distance between places, (T, 3) each [m]."""
    return float(np.linalg.norm(found - wanted, axis=1).max())


def turn(found: Array, wanted: Array) -> Array:
    """Return the angle between attitudes, quaternions x y z w (T, 4). Shape (T,) [rad]."""
    a, b = found / _length(found), wanted / _length(wanted)
    vector = b[:, 3:] * a[:, :3] - a[:, 3:] * b[:, :3] - np.cross(b[:, :3], a[:, :3])
    scalar = np.einsum("ti,ti->t", a, b)
    angle: Array = 2.0 * np.arctan2(np.linalg.norm(vector, axis=1), np.abs(scalar))
    return angle


def _length(quaternions: Array) -> Array:
    length: Array = np.linalg.norm(quaternions, axis=1, keepdims=True)
    return length
