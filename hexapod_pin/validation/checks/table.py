"""The rows of a verification as text."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hexapod_pin.validation.checks.check import Row

HEAD = ("what", "source", "error", "tolerance", "unit", "s", "result")


def verdict(row: Row) -> str:
    """Return "pass", "FAIL" or "not run"."""
    if row.skipped:
        return "not run"
    return "pass" if row.passed else "FAIL"


def cells(row: Row) -> tuple[str, ...]:
    """Return a row as text."""
    numbers = (_size(row.error), _size(row.tolerance))
    return (row.what, row.source, *numbers, row.unit, f"{row.seconds:.1f}", verdict(row))


def table(rows: Sequence[Row]) -> str:
    """Return the rows with columns aligned, and one line per failure that has a reason."""
    lines = [HEAD, *(cells(row) for row in rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(HEAD))]
    text = ["  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip()
            for line in lines]  # fmt: skip
    rule = "-" * (sum(widths) + 2 * (len(widths) - 1))
    notes = [f"{row.what}: {row.note}" for row in rows if row.note and not row.passed]
    return "\n".join([text[0], rule, *text[1:], "", summary(rows), *notes])


def markdown(rows: Sequence[Row]) -> str:
    """Return the rows as a Markdown table."""
    lines = [HEAD, ["---"] * len(HEAD), *(cells(row) for row in rows)]
    return "".join(f"| {' | '.join(cell.replace('|', '/') for cell in x)} |\n" for x in lines)


def summary(rows: Sequence[Row]) -> str:
    """Return one line: how many passed, failed, were not run."""
    found = [verdict(row) for row in rows]
    parts = [f"{found.count(name)} {name}" for name in ("pass", "FAIL", "not run")]
    return f"{', '.join(parts)} of {len(rows)}, {sum(row.seconds for row in rows):.0f} s"


def _size(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.1e}"
