"""What a run remembers from one accepted state to the next; the laws themselves are pure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array

    Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Memory:
    """Of nj joints and C contacts.

    Attributes:
        angles: (nj,) joint angles [rad]; angles are taken within half a turn of these.
        touching: (C,) whether the contact was closed.
        touch_speed: (C,) approach speed before first touch [m/s].
        sliding: (C,) whether a bristle was on its cone.
    """

    angles: Array
    touching: Flags
    touch_speed: Array
    sliding: Flags

    @classmethod
    def fresh(cls, angles: Array, contacts: int) -> Memory:
        """Return a memory of contacts never seen."""
        none = np.zeros(contacts, dtype=bool)
        return cls(angles, none, np.zeros(contacts), none)

    def with_angles(self, angles: Array) -> Memory:
        """Return the same with other angles."""
        return replace(self, angles=angles)

    def unwrapped(self, angles: Array) -> Array:
        """Return angles known to a turn (nj,) as those nearest to the remembered ones."""
        turns = np.round((self.angles - angles) / (2.0 * np.pi))
        return np.asarray(angles + 2.0 * np.pi * turns)
