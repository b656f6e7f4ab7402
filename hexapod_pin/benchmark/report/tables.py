"""The tables of a report as plain rows of text, for the terminal and for Markdown alike."""

from __future__ import annotations

import math

from hexapod_pin.benchmark.work_precision.comparison import Comparison
from hexapod_pin.benchmark.work_precision.entry import OURS
from hexapod_pin.benchmark.work_precision.measure import BenchmarkRow
from hexapod_pin.benchmark.work_precision.tolerance_sweep import (
    LEVELS,
    Measure,
    cheapest,
    resolved,
    sweeps,
)
from hexapod_pin.validation.solver_setting import KEPT
from hexapod_pin.validation.tables import Table


def tables(comparison: Comparison) -> list[Table]:
    """Return the tables of one scene: cost by level, and every run."""
    found = [level_table(comparison, "error")]
    if has_engines(comparison):
        found.append(level_table(comparison, "trunk"))
    kept = kept_table(comparison)
    return [*found, *([kept] if kept.rows else []), run_table(comparison)]


def has_engines(comparison: Comparison) -> bool:
    """Tell whether another engine has rows."""
    return any(row.engine != OURS for row in comparison.rows)


def level_table(comparison: Comparison, measure: Measure) -> Table:
    """Return the cheapest setting of every method at every level.

    With "error" ours alone are compared, by all positions; with "trunk" all engines.
    """
    what = "any position [m, rad]" if measure == "error" else "the trunk's place [m]"
    groups = {
        name: own
        for name, own in sweeps(comparison.rows).items()
        if measure == "trunk" or name[0] == OURS
    }
    levels = LEVELS if measure == "error" else LEVELS[:4]
    rows = tuple(
        (_name(engine, method), *(_cell(own, level, measure) for level in levels))
        for (engine, method), own in groups.items()
    )
    title = f"Cost to reach an error of {what}: ms per simulated second (evaluations)"
    return Table(title, ("method", *(f"{level:.0e}" for level in levels)), rows)


def kept_table(comparison: Comparison) -> Table:
    """Return the error asked for beside the error got, and the cost over that of a single run."""
    groups = sweeps(comparison.rows)
    rows = []
    for (engine, method), own in groups.items():
        single = {row.value: row for row in groups.get((engine, method.removesuffix(KEPT)), [])}
        if method.endswith(KEPT):
            rows += [_kept(row, single.get(row.value)) for row in own]
    head = (
        "method", "error asked for [m, rad]", "error got", "over asked", "own estimate over got",
        "wall time over a single run's", "evaluations over a single run's", "result",
    )  # fmt: skip
    return Table("Error asked for, error got", head, tuple(rows))


def _kept(row: BenchmarkRow, single: BenchmarkRow | None) -> tuple[str, ...]:
    """Return a row of `kept_table`; the single run is the one of the same accuracy."""
    ratios = (row.error / row.value, row.estimate / max(row.error, row.uncertainty))
    costs = ("-", "-")
    if single is not None and single.ended and row.evaluations and single.evaluations:
        costs = (
            f"{row.wall / single.wall:.2f}", f"{row.evaluations / single.evaluations:.2f}",
        )  # fmt: skip
    return (
        row.method.removesuffix(KEPT), f"{row.value:.0e}", _error(row.error),
        *(f"{ratio:.2g}" if math.isfinite(ratio) else "-" for ratio in ratios), *costs, row.verdict,
    )  # fmt: skip


def run_table(comparison: Comparison) -> Table:
    """Return every run: error and cost side by side."""
    head = (
        "method", "setting", "error [m, rad]", "own estimate", "trunk [m]", "ms per s", "runs",
        "evaluations per s", "steps per s", "rejected per s", "result", "note",
    )  # fmt: skip
    rows = tuple(_run(row) for row in comparison.rows)
    return Table("Every run", head, rows)


def _run(row: BenchmarkRow) -> tuple[str, ...]:
    counts = (row.evaluations, row.steps, row.rejected)
    return (
        _name(row.engine, row.method), row.setting, _error(row.error),
        _error(row.estimate), _error(row.trunk),
        f"{row.wall * 1e3:.3g}" if math.isfinite(row.wall) else "-", str(row.runs),
        *(_count(count) for count in counts), row.verdict, "" if row.refused else row.note,
    )  # fmt: skip


def _cell(own: list[BenchmarkRow], level: float, measure: Measure) -> str:
    """Return "5.6 (1.9k)"; in words where a level is not reached or the reference does not tell."""
    if not resolved(own, level):
        return f"not judged: reference {max(row.uncertainty for row in own):.0e}"
    row = cheapest(own, level, measure)
    if row is None:
        return f"not reached: {_tightest(own, measure)}"
    cost = f"{row.wall * 1e3:.3g}"
    return cost if row.evaluations is None else f"{cost} ({_count(row.evaluations)})"


def _tightest(own: list[BenchmarkRow], measure: Measure) -> str:
    """Return the error at the tightest setting, or that its run did not end."""
    error = getattr(own[-1], measure)
    return f"{error:.0e}" if math.isfinite(error) else "did not end"


def row_name(row: BenchmarkRow) -> str:
    """Return method, setting and what became of it."""
    return f"{_name(row.engine, row.method)}, {row.setting} ({row.verdict})"


def _name(engine: str, method: str) -> str:
    return method if engine == OURS else f"{engine} {method}"


def _error(value: float) -> str:
    return f"{value:.1e}" if math.isfinite(value) else "-"


def _count(value: float | None) -> str:
    """Return a count with three digits, in thousands where it is large."""
    if value is None:
        return "-"
    for scale, letter in ((1e6, "M"), (1e3, "k")):
        if value >= scale:
            return f"{value / scale:.3g}{letter}"
    return f"{value:.0f}"
