"""The runs of a study over a grid, and some of them again at a tighter accuracy."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import DivergenceError, GaitError, ParameterError, ReachError
from hexapod_pin.results.grid_columns import NOT_RUN, AccuracyCheck, relative_change
from hexapod_pin.simulation.case import Case
from hexapod_pin.study.runs.measure import Measure
from hexapod_pin.study.runs.runner import Runner

Place = tuple[int, ...]
"""An index per axis of the grid."""

Numbers = dict[str, Any]
"""What a run comes to: a number or an array for each quantity."""

Cases = Mapping[Place, Case | Exception]
"""What is run, or why it cannot be, by its place."""

Measures = Measure[Numbers] | Mapping[Place, Measure[Numbers]]
"""What is kept of each run: the same of all, or by place."""

TIGHTER = 0.1
"""Accuracy of repeated runs over that of the others."""

UNWALKABLE = (GaitError, ReachError, DivergenceError, RuntimeError)
"""What makes a point NaN; anything else is a mistake in the call, and is raised."""


def grid_results(
    run: Runner,
    cases: Cases,
    measures: Measures,
    order: Callable[[Place], tuple[int, float]],
    check: int,
    parts: int = 1,
) -> tuple[dict[Place, Numbers | str], AccuracyCheck | None]:
    """Run the cases of a grid, and some of them again at a tighter accuracy.

    Args:
        run: runs them.
        cases: what is run, or why it cannot be, by its place.
        measures: returns the numbers of a run: one measure, or one by place.
        order: the part of the grid that a point belongs to, and its place in that part.
        check: how many walked points of each part run again, evenly spread; 0: none.
        parts: number of parts of the grid, for the progress.

    Returns:
        Numbers of each point, or the reason why it has none. What changed at the points that ran
        again; None without any, or if Ctrl-C came before the last one.

    Raises:
        HexapodError: a run was refused for a mistake in the call.
    """
    end = len(cases) / (len(cases) + check * parts)
    found = _rows(run, cases, measures, (0.0, end))
    walked = sorted((p for p, numbers in found.items() if not isinstance(numbers, str)), key=order)
    if not walked or check < 1 or run.interrupted:
        return found, None
    chosen = set()
    for _, group in itertools.groupby(walked, key=lambda place: order(place)[0]):
        part = list(group)
        chosen |= {part[round(k)] for k in np.linspace(0, len(part) - 1, min(check, len(part)))}
    tighter: dict[Place, Case | Exception] = {}
    for place in sorted(chosen):
        case = cases[place]
        if isinstance(case, Case) and case.accuracy is not None:
            tighter[place] = replace(case, accuracy=TIGHTER * _resolved(case))
    again = _rows(run, tighter, measures, (end, 1.0))
    pairs = [(place, found[place], numbers) for place, numbers in again.items()]
    return found, None if run.interrupted else _check(pairs, tighter)


def _rows(
    run: Runner, cases: Cases, measures: Measures, span: tuple[float, float]
) -> dict[Place, Numbers | str]:
    given = measures if isinstance(measures, Measure) else [measures[place] for place in cases]
    rows = run.rows(cases.values(), given, span=span)
    found: dict[Place, Numbers | str] = {}
    for place, row in zip(cases, rows, strict=True):
        if row is None:
            found[place] = NOT_RUN
        else:
            found[place] = _reason(row) if isinstance(row, Exception) else row
    return found


def grid_arrays(
    found: Mapping[Place, Numbers | str], empty: Mapping[str, Array], shape: Sequence[int]
) -> dict[str, Any]:
    """Return the arrays of the grid, filled, and `reason`."""
    reason = np.full(tuple(shape), NOT_RUN, dtype=object)
    filled = {name: array.copy() for name, array in empty.items()}
    for place, numbers in found.items():
        reason[place] = numbers if isinstance(numbers, str) else ""
        for name, value in () if isinstance(numbers, str) else numbers.items():
            filled[name][place] = np.nan if value is None else value
    return {**filled, "reason": reason}


def _check(pairs: Iterable[Any], cases: Cases) -> AccuracyCheck | None:
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


def _reason(error: Exception) -> str:
    """Return why a point cannot be walked, or raise what is no such reason."""
    if isinstance(error, UNWALKABLE):
        return f"{type(error).__name__}: {error}"
    raise error


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


def _resolved(case: Case) -> float:
    """Return the accuracy of a case, or the loosest that makes a difference to it [m and rad]."""
    return case.settings.method_settings.resolved_accuracy
