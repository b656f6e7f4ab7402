"""The results of the validation cases as a table, and in one line."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from hexapod_pin.text_table import Table
from hexapod_pin.validation.case_result import CaseResult

RESULT_HEAD = ("case", "what", "method or source", "error", "tolerance", "unit", "result", "note")


def result_table(results: Sequence[CaseResult], title: str = "") -> Table:
    """Return every result as text."""
    return Table(title, RESULT_HEAD, tuple(_cells(result) for result in results))


def _cells(result: CaseResult) -> tuple[str, ...]:
    unit = result.unit or ("relative" if result.computed else "-")
    note = "" if result.kind == "not run" else result.note
    return (
        result.case, result.what, result.method, _size(result.error), _size(result.tolerance),
        unit, result.verdict, note,
    )  # fmt: skip


def _size(value: float) -> str:
    if math.isnan(value):
        return "-"
    return "0" if value == 0.0 else f"{value:.1e}"


def summary(results: Sequence[CaseResult]) -> str:
    """Return one line: how many rows passed, failed, failed as expected, were not run."""
    count = Counter[str](result.kind for result in results)
    parts = [f"{count[kind]} {kind}" for kind in ("pass", "FAIL")]
    others = ("expected failure", "unexpected pass", "not run")
    parts += [f"{count[kind]} {kind}" for kind in others if count[kind]]
    seconds = sum(result.seconds for result in results)
    return f"{', '.join(parts)}; {len(results)} results, {seconds:.0f} s"


def failures_text(results: Sequence[CaseResult]) -> str:
    """Return one line that names every row that fails its table."""
    failed = [
        f"{result.case}, {result.what} ({result.verdict.partition(':')[0]})"
        for result in results
        if result.failed
    ]
    return f"{len(failed)} of {len(results)} rows missed: {'; '.join(failed)}"


def part_verdict(missed: int, runs: int) -> str:
    """Return "pass", or "FAIL: 2 of 60 runs" for a row of several runs."""
    return f"FAIL: {missed} of {runs} runs" if missed else "pass"


def worst_results(results: Sequence[CaseResult]) -> list[CaseResult]:
    """Return, of every case and method, the result nearest to or farthest beyond its tolerance."""
    worst: dict[tuple[str, str], CaseResult] = {}
    for result in results:
        key = (result.case, result.method)
        if key not in worst or _strain(result) > _strain(worst[key]):
            worst[key] = result
    return list(worst.values())


def _strain(result: CaseResult) -> tuple[bool, float]:
    """Return whether it failed, and error over tolerance; what was not computed comes last."""
    if not result.computed:
        return False, -1.0
    if result.tolerance == 0.0:
        return result.failed, math.inf if result.error else 0.0
    return result.failed, result.error / result.tolerance
