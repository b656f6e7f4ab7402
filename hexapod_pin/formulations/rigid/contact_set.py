"""Which feet the ground holds, and the rows that hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError


@dataclass(frozen=True)
class Grip:
    """Which feet the ground holds, by index.

    Attributes:
        stuck: feet that do not move at all.
        smooth: feet that slide without friction: held along the normal only.
    """

    stuck: tuple[int, ...]
    smooth: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Check that no foot is held twice.

        Raises:
            ParameterError: one is.
        """
        if len(set(self.feet)) != len(self.feet):
            raise ParameterError("feet", self.feet, "each given once")

    @property
    def feet(self) -> tuple[int, ...]:
        """All of them, in the order of their rows."""
        return (*self.stuck, *self.smooth)

    def rows(self, all_rows: Array, normal: Array) -> Array:
        """Return the rows that are held, of those of all feet (F, 3, nv). Shape (3k + l, nv)."""
        size = all_rows.shape[2]
        full = all_rows[list(self.stuck)].reshape(-1, size)
        single = np.einsum("i,fij->fj", normal, all_rows[list(self.smooth)])
        return np.vstack([full, single])

    def spread(self, values: Array, normal: Array, count: int) -> Array:
        """Return multipliers (3k + l,) as forces on all `count` feet. Shape (F, 3)."""
        force, cut = np.zeros((count, 3)), 3 * len(self.stuck)
        force[list(self.stuck)] = values[:cut].reshape(-1, 3)
        force[list(self.smooth)] = values[cut:, None] * normal
        return force

    def spread_flags(self, unique: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
        """Return flags of the multipliers for all `count` feet. Shape (F, 3)."""
        flags, cut = np.ones((count, 3), dtype=bool), 3 * len(self.stuck)
        flags[list(self.stuck)] = unique[:cut].reshape(-1, 3)
        flags[list(self.smooth)] = unique[cut:, None]
        return flags
