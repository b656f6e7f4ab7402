"""What a sampled study says of one quantity: percentiles, the share that passes, what decides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked, explain_methods
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.summary_layout import LAYOUT
from hexapod_pin.sweep.sensitivity import SobolIndices, sobol_indices
from hexapod_pin.sweep.study.sweep_study import SweepStudy

PERCENTS = (5, 50, 95, 99)
"""Which percentiles are told."""

LEVEL = 0.95
"""Probability of the interval of a share."""


@explain_methods
@dataclass(frozen=True, eq=False)
class Uncertainty:
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
        names = "  ".join(f"{f'p{p}':>9}" for p in self.percentiles)
        numbers = "  ".join(f"{value:9.4g}" for value in self.percentiles.values())
        lines = [f"{self.quantity}{unit}, {self.finished} of {self.walks} walks", names, numbers]
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
    unit = getattr(found, "attrs", {}).get("units") or (
        LAYOUT[quantity][1] if quantity in LAYOUT else ""
    )
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
