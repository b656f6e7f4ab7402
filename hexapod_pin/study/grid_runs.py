"""The runs of a sweep over a grid: read as they finish, and some of them at a tighter accuracy."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.body_path import TRANSIENT_CYCLES
from hexapod_pin.errors import (
    DivergenceError,
    GaitError,
    ParameterError,
    ReachError,
)
from hexapod_pin.results.grid_columns import NOT_RUN, AccuracyCheck, relative_change
from hexapod_pin.simulation.case import Case
from hexapod_pin.study.runs.measure import Measure
from hexapod_pin.study.runs.runner import Runner
from hexapod_pin.study.sweep.base_case import LONGEST_SAMPLE

Place = tuple[int, ...]
"""An index per axis of the grid."""

Numbers = Mapping[str, Any]
"""What a run comes to: a number or an array for each quantity."""

SAMPLES_PER_CYCLE = 120
"""Samples of a cycle are a multiple of this: duty and phases of named gaits fall on samples."""

TIGHTER = 0.1
"""Accuracy of repeated runs over that of the others."""

UNWALKABLE = (GaitError, ReachError, DivergenceError, RuntimeError)
"""What makes a point NaN; anything else is a mistake in the call, and is raised."""


def walk_times(cycle_time: float, cycles: int, least: int = 1) -> tuple[float, float]:
    """Return duration and sample [s] of a run of whole cycles after the start-up.

    Args:
        cycle_time: [s].
        cycles: how many.
        least: samples of a cycle, at least.
    """
    wanted = max(float(least), cycle_time / LONGEST_SAMPLE)
    count = SAMPLES_PER_CYCLE * math.ceil(wanted / SAMPLES_PER_CYCLE)
    sample = cycle_time / count
    return (TRANSIENT_CYCLES + cycles) * count * sample, sample


@dataclass
class GridRuns:
    """Runs of a grid under way.

    Attributes:
        runner: runs the cases.
        cases: what is run, or why it cannot be, by its place.
        measure: gives the numbers of a run, or of the run at each place.
        extra: runs that will come after these, for the progress.
        found: the numbers of each place, or why there are none.
    """

    runner: Runner
    cases: Mapping[Place, Case | Exception]
    measure: Measure[Any] | Mapping[Place, Measure[Any]]
    extra: int = 0
    found: dict[Place, Numbers | str] = field(default_factory=dict)

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the runs."""
        return self.runner.interrupted

    def run(self) -> None:
        """Run all cases; Ctrl-C leaves the rest "not run"."""
        total = len(self.cases) + self.extra
        self.found |= self._rows(self.cases, (0.0, len(self.cases) / max(1, total)))

    def _rows(
        self, cases: Mapping[Place, Case | Exception], span: tuple[float, float]
    ) -> dict[Place, Numbers | str]:
        """Return the numbers of cases, or why there are none."""
        one = self.measure
        measures = one if isinstance(one, Measure) else [one[place] for place in cases]
        rows = self.runner.rows(cases.values(), measures, span=span)
        return {place: _numbers(row) for place, row in zip(cases, rows, strict=True)}

    def check(
        self, count: int, order: Callable[[Place], tuple[int, float]]
    ) -> AccuracyCheck | None:
        """Repeat some walked points at a tighter accuracy.

        Args:
            count: how many of each part of the grid, evenly through its walked points; 0: none.
            order: the part of the grid that a point belongs to, and its place in it.

        Returns:
            What changed; None where nothing was repeated, or Ctrl-C came before the end.
        """
        walked = sorted(
            (place for place, found in self.found.items() if not isinstance(found, str)), key=order
        )
        if not walked or count < 1 or self.interrupted:
            return None
        chosen = sorted(
            {
                part[round(k)]
                for part in _parts(walked, lambda place: order(place)[0])
                for k in np.linspace(0, len(part) - 1, min(count, len(part)))
            }
        )
        cases: dict[Place, Case | Exception] = {}
        for place in chosen:
            case = self.cases[place]
            if isinstance(case, Case) and case.accuracy is not None:
                cases[place] = replace(case, accuracy=TIGHTER * case.accuracy)
        first = len(self.cases) / (len(self.cases) + self.extra)
        again = self._rows(cases, (first, 1.0))
        pairs = [(p, self.found[p], found) for p, found in again.items()]
        return None if self.interrupted else _check(pairs, cases)

    def arrays(self, empty: Mapping[str, Array], shape: Sequence[int]) -> dict[str, Any]:
        """Return the arrays of the grid, filled, and `reason`."""
        reason = np.full(tuple(shape), NOT_RUN, dtype=object)
        filled = {name: array.copy() for name, array in empty.items()}
        for place, found in self.found.items():
            reason[place] = found if isinstance(found, str) else ""
            for name, value in () if isinstance(found, str) else found.items():
                filled[name][place] = np.nan if value is None else value
        return {**filled, "reason": reason}


def _parts(places: Sequence[Place], part: Callable[[Place], int]) -> list[list[Place]]:
    """Return the places of each part of a grid, in their order."""
    found: dict[int, list[Place]] = {}
    for place in places:
        found.setdefault(part(place), []).append(place)
    return list(found.values())


def _check(pairs: Iterable[Any], cases: Mapping[Place, Case | Exception]) -> AccuracyCheck | None:
    """Return what changed between the numbers of two runs at each place."""
    known = [(p, a, b) for p, a, b in pairs if not isinstance(a, str) and not isinstance(b, str)]
    if not known:
        return None
    names = tuple(name for name in known[0][1] if name != "phase_torque_rms_error")
    change = [[_change(a[name], b[name]) for name in names] for _, a, b in known]
    accuracy = next(float(c.accuracy or 0.0) for c in cases.values() if isinstance(c, Case))
    return AccuracyCheck(accuracy, np.array([p for p, _, _ in known]), names, np.array(change))


def _change(value: Any, other: Any) -> float:
    return float("nan") if value is None or other is None else relative_change(value, other)


def _numbers(row: Any) -> Numbers | str:
    """Return the numbers of a row, or why a point cannot be walked; raise what is no such reason.

    Raises:
        Exception: a mistake in the call.
    """
    if row is None:
        return NOT_RUN
    if not isinstance(row, Exception):
        numbers: Numbers = row
        return numbers
    if isinstance(row, UNWALKABLE):
        return f"{type(row).__name__}: {row}"
    raise row


def grid_axis(name: str, values: Any) -> Array:
    """Return the values of an axis, checked.

    Raises:
        ParameterError: they are not positive, finite and ascending.
    """
    axis = np.array(values, dtype=float)
    if axis.ndim != 1 or not len(axis) or not np.isfinite(axis).all() or axis.min() <= 0.0:
        raise ParameterError(name, values, "at least one number, positive and finite")
    if (np.diff(axis) <= 0.0).any():
        raise ParameterError(name, values, "ascending")
    return axis


def check_counts(cycles: int, check: int) -> None:
    """Refuse counts that are none.

    Raises:
        ParameterError: `cycles` below 1 or `check` below 0, or not whole.
    """
    for name, value, least in (("cycles", cycles, 1), ("check", check, 0)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise ParameterError(name, value, f"a whole number of at least {least}")
