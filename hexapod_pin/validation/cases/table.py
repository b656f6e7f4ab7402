"""The table of the hard cases, as text."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from hexapod_pin.benchmark.tables import Table
from hexapod_pin.validation.cases.case_result import HardRow

HEAD = ("case", "what", "method", "error", "tolerance", "unit", "result", "note")


def hard_table(rows: Sequence[HardRow]) -> Table:
    """Return every row as text."""
    return Table("Hard cases", HEAD, tuple(_cells(row) for row in rows))


def summary(rows: Sequence[HardRow]) -> str:
    """Return one line: how many rows passed, failed, fell short, were not run."""
    count = Counter(row.verdict for row in rows)
    return ", ".join(f"{count[name]} {name}" for name in ("pass", "FAIL", "short", "not run"))


def worst_rows(rows: Sequence[HardRow]) -> list[HardRow]:
    """Return, of every case and method, the row nearest to or farthest beyond its tolerance."""
    worst: dict[tuple[str, str], HardRow] = {}
    for row in rows:
        key = (row.case, row.method)
        if key not in worst or _strain(row) > _strain(worst[key]):
            worst[key] = row
    return list(worst.values())


def _strain(row: HardRow) -> float:
    """Return error over tolerance; rows that were not run last."""
    if not row.covered:
        return -1.0
    return row.error / row.tolerance if row.tolerance > 0.0 else (math.inf if row.error else 0.0)


def _cells(row: HardRow) -> tuple[str, ...]:
    return (
        row.case, row.what, row.method, _size(row.error), _size(row.tolerance),
        row.unit or ("-" if not row.covered else "relative"), row.verdict,
        row.note.replace("|", "/"),
    )  # fmt: skip


def _size(value: float) -> str:
    if math.isnan(value):
        return "-"
    return "0" if value == 0.0 else f"{value:.1e}"
