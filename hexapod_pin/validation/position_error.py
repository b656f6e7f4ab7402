"""How far two runs are apart: all positions, or the trunk alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.error_estimate import angle_between


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
            float(angle_between(found[:, 3:7], wanted[:, 3:7]).max()),
            float(joints.max(initial=0.0)),
        )
        return cls(largest, trunk_error(found[:, :3], wanted[:, :3]))


def trunk_error(found: Array, wanted: Array) -> float:
    """Return the largest distance between places, (T, 3) each [m]."""
    return float(np.linalg.norm(found - wanted, axis=1).max())
