"""A sampled study gives percentiles, the fraction that passes, and Sobol indices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.schema import schema
from hexapod_pin.results.summary import Summary
from hexapod_pin.study.sweep.sweep_study import SweepStudy
from hexapod_pin.text_table import Table

# Sobol indices from evaluations at Saltelli's points, with bootstrap intervals.
#
# First-order index: share of the variance that goes if the input is known; total index: share that
# stays while only it is unknown, interactions included (Saltelli et al. 2010).

RESAMPLES = 499
"""Bootstrap resamples of the rows of A, B and AB."""


SEED = 20260
"""Of the resamples: the same evaluations give the same intervals."""

LEAST_ROWS = 2
"""Fewest rows of A."""


@dataclass(frozen=True, eq=False)
class SobolIndices(Immutable):
    """Indices of d inputs, each with the ends of its 95 % interval.

    Attributes:
        of: description of what varies.
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
        rows = [
            [
                self.names[k],
                *(
                    f"{value:6.3f} ({low:.3f} to {high:.3f})"
                    for value, (low, high) in (
                        (self.first[k], self.first_interval[k]),
                        (self.total[k], self.total_interval[k]),
                    )
                ),
            ]
            for k in self.order
        ]
        table = Table("", ("input", " first order", " total"), rows, rule=False)
        return "\n".join(table.lines())


@checked
def sobol_indices(
    values: Array, names: Sequence[str], of: str = "the result", resamples: int = RESAMPLES
) -> SobolIndices:
    """Return indices from stored evaluations.

    Args:
        values: at the rows of A, B, AB_1 ... AB_d, one after the other; AB_i is A with column i of
            B. All finite. Shape (n (d + 2),), n a power of two.
        names: of the d inputs.
        of: description of the values.
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
    rng = np.random.default_rng(SEED)
    drawn = np.array([_indices(rows[:, rng.integers(0, n, n)]) for _ in range(resamples)])
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


# The result of a sampled study for one quantity: percentiles, the share that passes, what decides.

PERCENTS = (5, 50, 95, 99)
"""Percentiles that are reported."""

LEVEL = 0.95
"""Probability of the interval of a share."""


@dataclass(frozen=True, eq=False)
class Uncertainty(Immutable):
    """One quantity of the walks of a study, over its uncertain inputs.

    Attributes:
        quantity: its name.
        unit: its unit; empty where none is known.
        walks: number of independent samples: all rows of a design, of "sobol-indices" A and B.
        finished: how many of them have a number; the others failed or fell.
        percentiles: percent -> value, of those that have one; NaN where none has.
        limit: what a walk must keep; None: none.
        at_least: whether values must be at least the limit, not at most.
        passing: how many walks keep it; one without a number does not. None without a limit.
        interval: of the share that passes, 95 % (Clopper and Pearson 1934); None without a limit.
        indices: Sobol indices of the quantity; None without a "sobol-indices" design, or where a
            case has no number.
        pass_indices: Sobol indices of passing (1) or not (0); None without such a design or limit.
    """

    quantity: str
    unit: str
    walks: int
    finished: int
    percentiles: Mapping[int, float]
    limit: float | None
    at_least: bool
    passing: int | None
    interval: tuple[float, float] | None
    indices: SobolIndices | None
    pass_indices: SobolIndices | None

    @property
    def share(self) -> float | None:
        """Share of the walks that pass [-]; None without a limit."""
        return None if self.passing is None else self.passing / self.walks

    @property
    def failed(self) -> int:
        """Walks without a number: they failed or fell."""
        return self.walks - self.finished

    @property
    def deciding(self) -> SobolIndices | None:
        """The indices that say which input decides; None where there are none.

        Of passing where they single out one input, else of the quantity where it is known of all
        cases, else of passing.
        """
        passing = self.pass_indices
        if passing is not None and len(passing.deciding) == 1:
            return passing
        if self.indices is not None and self.indices.varies:
            return self.indices
        return passing

    @property
    def sentence(self) -> str:
        """The finding in one sentence."""
        parts = [self._passes() if self.limit is not None else self._range()]
        if self.failed:
            counted = ", counted as not passing" if self.limit is not None else ""
            parts.append(f"{self.failed} of them failed or fell{counted}")
        if (found := self.deciding) is not None and found.varies:
            text = found.text
            parts.append(text if found is self.pass_indices or self.limit is None else
                         text.replace(" decides", f" decides {self.quantity}"))  # fmt: skip
        return "; ".join(parts)

    def _passes(self) -> str:
        low, high = self.interval or (np.nan, np.nan)
        return (
            f"passes with {_percent(self.share or 0.0)} % confidence (95 % interval "
            f"{_percent(low)} to {_percent(high)} %, {self.walks} walks)"
        )

    def _range(self) -> str:
        low, middle, high = (f"{self.percentiles[p]:.4g}" for p in (5, 50, 95))
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"{self.quantity} {middle}{unit}, 90 % of walks {low} to {high}{unit} "
            f"({self.walks} walks)"
        )

    def table(self) -> str:
        """Return percentiles, the share that passes, and indices as text."""
        unit = f" [{self.unit}]" if self.unit else ""
        title = f"{self.quantity}{unit}, {self.finished} of {self.walks} walks"
        head, row = [f"p{p}" for p in self.percentiles], list(self.percentiles.values())
        lines = Table(title, head, [row], ">", rule=False, least=9).lines()
        for title, found in (("passing", self.pass_indices), (self.quantity, self.indices)):
            if found is not None and found.varies:
                lines += ["", f"Sobol indices of {title} (95 % interval)", found.table()]
        return "\n".join([*lines, "", self.sentence])

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data."""
        data: dict[str, Any] = {
            "quantity": self.quantity,
            "unit": self.unit,
            "walks": self.walks,
            "finished": self.finished,
            "percentiles": {str(p): value for p, value in self.percentiles.items()},
            "sentence": self.sentence,
        }
        if self.limit is not None and self.interval is not None:
            sense = "at least" if self.at_least else "at most"
            data |= {"limit": self.limit, "sense": sense, "passing": self.passing}
            data |= {"share": self.share, "interval": list(self.interval)}
        for name in ("indices", "pass_indices"):
            found = getattr(self, name)
            if found is not None:
                data[name] = {
                    "inputs": list(found.names),
                    "first": found.first.tolist(),
                    "first_interval": found.first_interval.tolist(),
                    "total": found.total.tolist(),
                    "total_interval": found.total_interval.tolist(),
                }
        return data


@checked
def uncertainty(
    study: SweepStudy,
    values: Mapping[str, Any],
    quantity: str,
    limit: float | None = None,
    *,
    at_least: bool = False,
    grid_point: int | None = None,
) -> Uncertainty:
    """Return what the cases of a study say of one quantity.

    Args:
        study: with a design; all of its cases must have been run.
        values: one number per case by the name of the quantity, in the order of the cases, NaN of
            a case that failed or fell; a mapping or an xarray dataset. Shape (cases,).
        quantity: which of them.
        limit: what a walk must keep; None: none.
        at_least: whether values must be at least the limit; else at most.
        grid_point: which point of the study's grid, counted as its cases are; None: the only one.

    Raises:
        ParameterError: no such quantity, not one number per case, no design, a limit that is not
            finite, or several grid points and none chosen.
    """
    given, unit = _values(study, values, quantity)
    if study.design is None:
        allowed = "one with distributions and a design"
        raise ParameterError("study", f"{study.name!r}, a grid", allowed)
    if limit is not None and not np.isfinite(limit):
        raise ParameterError("limit", limit, f"finite [{unit or 'the unit of the quantity'}]")
    rows = given[_grid_slice(study, grid_point)]
    names = [item.name for item in study.uncertain]
    samples = rows[: 2 * study.design.samples] if study.gives_indices else rows
    known = samples[np.isfinite(samples)]
    percentiles = {p: float(np.percentile(known, p)) if known.size else np.nan for p in PERCENTS}
    passing, interval, pass_indices = None, None, None
    if limit is not None:
        good = rows >= limit if at_least else rows <= limit  # NaN is neither
        passing = int(good[: len(samples)].sum())
        interval = clopper_pearson(passing, len(samples))
        if study.gives_indices:
            pass_indices = sobol_indices(good.astype(float), names, "passing")
    indices = None
    if study.gives_indices and np.isfinite(rows).all():
        indices = sobol_indices(rows, names, quantity)
    return Uncertainty(
        quantity, unit, len(samples), known.size, percentiles,
        limit, at_least, passing, interval, indices, pass_indices,
    )  # fmt: skip


def clopper_pearson(passing: int, walks: int, level: float = LEVEL) -> tuple[float, float]:
    """Return the exact interval of a share: ends at which so few or so many have (1 - level) / 2.

    It holds for independent samples; quasi-random ones are spread more evenly, so that it is wide
    rather than narrow for them.

    Args:
        passing: how many pass.
        walks: of how many.
        level: probability of the interval.

    Raises:
        ParameterError: no walks, or more that pass than there are, or a level that is none.
    """
    from scipy.stats import beta

    if walks < 1:
        raise ParameterError("walks", walks, "at least 1")
    if not 0 <= passing <= walks:
        raise ParameterError("passing", passing, f"0 to {walks}")
    if not 0.0 < level < 1.0:
        raise ParameterError("level", level, "above 0 and below 1")
    tail, rest = 0.5 * (1.0 - level), walks - passing
    low = 0.0 if passing == 0 else float(beta.ppf(tail, passing, rest + 1))
    high = 1.0 if rest == 0 else float(beta.ppf(1.0 - tail, passing + 1, rest))
    return low, high


def _values(study: SweepStudy, values: Mapping[str, Any], quantity: str) -> tuple[Array, str]:
    """Return one number per case, and its unit."""
    known = [str(name) for name in values]
    if quantity not in known:
        raise ParameterError("quantity", quantity, f"one of {', '.join(known)}")
    found = values[quantity]
    array = read_only(found)
    if array.shape != (len(study),):
        raise ParameterError(
            f"values[{quantity!r}]", f"an array of shape {array.shape}",
            f"one number per case, of shape ({len(study)},)",
            "Take one number of a quantity per joint or foot, such as the largest of its sizes.",
        )  # fmt: skip
    declared = schema(Summary).get(quantity)
    unit = getattr(found, "attrs", {}).get("units") or (declared.unit if declared else "")
    return array, str(unit)


def _grid_slice(study: SweepStudy, point: int | None) -> slice:
    """Return the cases of a grid point."""
    count = study.grid_points
    if point is None and count > 1:
        allowed = f"given, 0 to {count - 1}: the study has {count} grid points"
        raise ParameterError("grid_point", None, allowed)
    if point is not None and not 0 <= point < count:
        raise ParameterError("grid_point", point, f"0 to {count - 1}")
    begin = (point or 0) * study.rows
    return slice(begin, begin + study.rows)


def _percent(share: float) -> str:
    """Return a share in percent; one that is not 0 or 100 % never reads so."""
    percent = 100.0 * share
    for digits in range(1 if not 1.0 <= percent <= 99.0 else 0, 9):
        text = f"{percent:.{digits}f}"
        if float(text) not in (0.0, 100.0):
            return text
    return f"{percent:.0f}"
