"""The cheapest setting of each method that reaches an error, and all tighter ones with it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

from hexapod_pin.benchmark.work_precision.entry import OURS
from hexapod_pin.benchmark.work_precision.measure import BenchmarkRow

LEVELS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
DEFAULT = "extrapolated-euler"
"""The method that `simulate` takes where none is named."""

Measure = Literal["error", "trunk"]


def sweeps(rows: Iterable[BenchmarkRow]) -> dict[tuple[str, str], list[BenchmarkRow]]:
    """Return the rows by engine and method, loosest first, without refused settings."""
    found: dict[tuple[str, str], list[BenchmarkRow]] = {}
    for row in rows:
        if not row.refused:
            found.setdefault((row.engine, row.method), []).append(row)
    return {name: sorted(own, key=lambda row: -row.value) for name, own in found.items()}


def cheapest(
    own: Sequence[BenchmarkRow], level: float, measure: Measure = "error"
) -> BenchmarkRow | None:
    """Return the cheapest setting of one method whose error is at most `level`.

    A setting counts only if every tighter one meets the level too: a run that hits it by chance
    does not. A run that diverged meets none. Within one method the count of evaluations tells
    which is cheapest, where there is one: it has no noise.

    Args:
        own: rows of one method, loosest first.
        level: wanted error [m, rad].
        measure: "error" for all positions, "trunk" for the trunk alone.
    """
    best: BenchmarkRow | None = None
    for row in reversed(own):
        if not getattr(row, measure) <= level:
            break
        if best is None or _cost(row) < _cost(best):
            best = row
    return best


def _cost(row: BenchmarkRow) -> float:
    return row.wall if row.evaluations is None else row.evaluations


def resolved(own: Sequence[BenchmarkRow], level: float) -> bool:
    """Tell whether the reference of a method is certain to the level."""
    return all(row.uncertainty <= level for row in own)


def best_of(
    rows: Iterable[BenchmarkRow], engine: str, level: float, measure: Measure = "trunk"
) -> BenchmarkRow | None:
    """Return the cheapest row of any method of an engine that reaches a level."""
    found = [
        cheapest(own, level, measure) for (name, _), own in sweeps(rows).items() if name == engine
    ]
    return min((row for row in found if row is not None), key=lambda row: row.wall, default=None)


def ratios(rows: Sequence[BenchmarkRow], levels: Sequence[float] = (1e-3, 1e-4)) -> list[str]:
    """Return one line per other engine and level: our wall time over its best."""
    engines = list(dict.fromkeys(row.engine for row in rows if row.engine != OURS))
    return [_ratio(rows, engine, level) for engine in engines for level in levels]


def _ratio(rows: Sequence[BenchmarkRow], engine: str, level: float) -> str:
    """Return the line of one engine and level: our best method's ratio, and the default's."""
    head = f"trunk within {level:.0e} m: "
    other = best_of(rows, engine, level)
    ours = best_of(rows, OURS, level)
    if ours is None:
        return f"{head}no method of ours reached it"
    default = best_of([row for row in rows if row.method == DEFAULT], OURS, level)
    shown = [ours] if default in (None, ours) else [ours, default]
    if other is None:
        mine = ", ".join(f"ours {_text(row)}" for row in shown if row)
        return f"{head}{mine}; no method of {engine} reached it"
    mine = ", ".join(
        f"ours {_text(row)}, ratio {row.wall / other.wall:.3f}" for row in shown if row
    )  # fmt: skip
    return f"{head}{engine} {_text(other)}; {mine}"


def _text(row: BenchmarkRow) -> str:
    return f"{row.wall * 1e3:.3g} ms ({row.method}, {row.setting})"
