"""S2 appendix eq. 3: which feet the ground constrains, and the rows J that constrain them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.formulations.rigid.model import EquationTerms


@dataclass(frozen=True)
class ContactSet:
    """The feet in contact, by index: k that stick have three rows each, l that slide have one.

    Attributes:
        sticking: feet that do not move at all.
        sliding: feet that slide without friction: constrained along the normal only.
    """

    sticking: tuple[int, ...]
    sliding: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Check that no foot is constrained twice.

        Raises:
            ParameterError: one is.
        """
        if len(set(self.feet)) != len(self.feet):
            raise ParameterError("feet", self.feet, "each given once")

    @property
    def feet(self) -> tuple[int, ...]:
        """All of them, in the order of their rows."""
        return (*self.sticking, *self.sliding)

    def rows(self, all_rows: Array, normal: Array) -> Array:
        """Return J (3k + l, nv) of these feet from the rows of all feet (F, 3, nv)."""
        size = all_rows.shape[2]
        full = all_rows[list(self.sticking)].reshape(-1, size)
        single = np.einsum("i,fij->fj", normal, all_rows[list(self.sliding)])
        return np.vstack([full, single])

    def equations(self, terms: EquationTerms, normal: Array) -> tuple[Array, Array]:
        """Return J (3k + l, nv) and J' v (3k + l,) of eq. 3, J a + J' v = 0."""
        full = terms.drift[list(self.sticking)].ravel()
        single = terms.drift[list(self.sliding)] @ normal
        return self.rows(terms.rows, normal), np.concatenate([full, single])

    def forces(self, multipliers: Array, normal: Array, count: int) -> Array:
        """Return multipliers (3k + l,) as forces on all `count` feet. Shape (F, 3)."""
        force, cut = np.zeros((count, 3)), 3 * len(self.sticking)
        force[list(self.sticking)] = multipliers[:cut].reshape(-1, 3)
        force[list(self.sliding)] = multipliers[cut:, None] * normal
        return force

    def force_flags(self, flags: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
        """Return flags of the multipliers for all `count` feet, True elsewhere. Shape (F, 3)."""
        found, cut = np.ones((count, 3), dtype=bool), 3 * len(self.sticking)
        found[list(self.sticking)] = flags[:cut].reshape(-1, 3)
        found[list(self.sliding)] = flags[cut:, None]
        return found
