"""Sobol indices from evaluations at Saltelli's points, with bootstrap intervals.

First-order index: share of the variance that goes if the input is known; total index: share that
stays while only it is unknown, interactions included (Saltelli et al. 2010).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError

RESAMPLES = 499
"""Bootstrap resamples of the rows of A, B and AB."""

LEVEL = 0.95
"""Probability of the intervals."""

SEED = 20260
"""Of the resamples: the same evaluations give the same intervals."""

LEAST_ROWS = 2
"""Fewest rows of A."""


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Indices of d inputs, each with the ends of its 95 % interval.

    Attributes:
        of: what varies, in words.
        names: of the inputs.
        first: first-order indices [-]. Shape (d,).
        first_interval: their ends. Shape (d, 2).
        total: total indices [-]. Shape (d,).
        total_interval: their ends. Shape (d, 2).
        samples: rows of A.
    """

    of: str
    names: tuple[str, ...]
    first: Array
    first_interval: Array
    total: Array
    total_interval: Array
    samples: int

    @property
    def varies(self) -> bool:
        """Whether there is any variance to divide."""
        return bool(self.total.max(initial=0.0) > 0.0)

    @property
    def order(self) -> tuple[int, ...]:
        """Inputs by total index, the largest first."""
        return tuple(int(k) for k in np.argsort(-self.total, kind="stable"))

    @property
    def deciding(self) -> tuple[str, ...]:
        """The input whose interval lies above all others', or those that share the top.

        Empty where nothing varies.
        """
        if not self.varies:
            return ()
        top = self.order[0]
        low = self.total_interval[top, 0]
        return tuple(
            self.names[k] for k in self.order if k == top or self.total_interval[k, 1] >= low
        )

    @property
    def text(self) -> str:
        """Which input decides, with its index; "X or Y" where their intervals overlap."""
        if not self.varies:
            return f"{self.of} does not vary: no input decides"
        places = [self.names.index(name) for name in self.deciding]
        words = [name.replace("_", " ") for name in self.deciding]
        if len(words) == 1:
            low, high = self.total_interval[places[0]]
            index = self.total[places[0]]
            return f"{words[0]} decides (total index {index:.2f}, {low:.2f} to {high:.2f})"
        indices = ", ".join(f"{self.total[k]:.2f}" for k in places)
        named = f"{', '.join(words[:-1])} or {words[-1]}"
        return f"{named} decides (total indices {indices}; their intervals overlap)"

    def table(self) -> str:
        """Return the indices with their intervals, the largest total index first."""
        wide = max(len("input"), *(len(name) for name in self.names))
        rows = [f"{'input':<{wide}}  first order            total"]
        for k in self.order:
            first, total = (
                f"{value:6.3f} ({low:.3f} to {high:.3f})"
                for value, (low, high) in (
                    (self.first[k], self.first_interval[k]),
                    (self.total[k], self.total_interval[k]),
                )
            )
            rows.append(f"{self.names[k]:<{wide}}  {first:<22} {total}")
        return "\n".join(rows)


def sobol_indices(
    values: Array, names: Sequence[str], of: str = "the result", resamples: int = RESAMPLES
) -> SobolIndices:
    """Return indices from stored evaluations.

    Args:
        values: at the rows of A, B, AB_1 ... AB_d, one after the other; AB_i is A with column i of
            B. All finite. Shape (n (d + 2),), n a power of two.
        names: of the d inputs.
        of: what the values are, in words.
        resamples: of the bootstrap.

    Raises:
        ParameterError: another number of values, or one that is not finite.
    """
    given = np.asarray(values, dtype=float)
    d = len(names)
    n, rest = divmod(given.size, d + 2)
    if given.ndim != 1 or rest or n < LEAST_ROWS or n & (n - 1):
        allowed = f"n ({d} + 2) values in a row, n a power of two: a sobol-indices design"
        raise ParameterError("values", f"an array of shape {given.shape}", allowed)
    if not np.isfinite(given).all():
        count = int((~np.isfinite(given)).sum())
        raise ParameterError("values", f"{count} not finite", "finite, each of them")
    rows = given.reshape(d + 2, n)
    found = _indices(rows)
    dice = np.random.default_rng(SEED)
    drawn = np.array([_indices(rows[:, dice.integers(0, n, n)]) for _ in range(resamples)])
    ends = np.quantile(drawn, [0.5 * (1.0 - LEVEL), 0.5 * (1.0 + LEVEL)], axis=0)
    first, total = (np.stack([ends[0, k], ends[1, k]], axis=-1) for k in (0, 1))
    return SobolIndices(of, tuple(names), found[0], first, found[1], total, n)


def _indices(rows: Array) -> Array:
    """Return first-order and total indices. Shape (2, d). Nil where nothing varies."""
    from scipy import stats

    d = len(rows) - 2
    f_ab = np.repeat(rows[2:, None, :], 2 if d == 1 else 1, axis=0)  # SciPy fails on one input
    found = stats.sobol_indices(
        func={"f_A": rows[:1], "f_B": rows[1:2], "f_AB": f_ab}, n=rows.shape[1]
    )
    return np.stack([found.first_order[:d], found.total_order[:d]])
