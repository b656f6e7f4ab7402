"""Peaks with their verdicts as plain text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from hexapod_pin.results.budget_table import aligned
from hexapod_pin.results.peak_verdict import HOLDS_WITHIN, NEGLIGIBLE_SHARE, PEAK

if TYPE_CHECKING:
    from hexapod_pin.results.peak_verdict import PeakVerdict, PeakVerdicts
    from hexapod_pin.results.recomputation import Recomputation, Spread

LEGEND = (
    f'"peak": it moved by no more than {100 * HOLDS_WITHIN:g} % under any of the changes, and '
    "stands as computed at ten times the accuracy. Ranges hold all values computed, the run's own "
    "too. Columns in % say how far each change moved the peak; peaks below "
    f"{100 * NEGLIGIBLE_SHARE:g} % of the robot's largest are compared with that "
    f"{100 * NEGLIGIBLE_SHARE:g} %. p99, RMS, impulse: at ten times the accuracy, then the least "
    "and the largest of all.",
    "What was not changed, such as mass, friction or ground, may move a peak that holds here.",
)


def verdict_text(verdicts: PeakVerdicts) -> str:
    """Return the verdicts as plain text with units."""
    window, changes = verdicts.window, verdicts.recomputations
    cycles = "" if window.cycles is None else f", {window.cycles} whole gait cycle(s)"
    per = "window" if window.cycles is None else "cycle"
    parts = (
        [
            f"Peaks with a verdict, {verdicts.robot}",
            f"window: {window.start:.4g} to {window.end:.4g} s{cycles}",
            *verdicts.sources,
        ],
        ["Computed again with", *(f"  {_change_line(row)}" for row in changes)],
        ["Largest peak of each kind", *(f"  {row.name}: {row.text}" for row in verdicts.kinds)],
        ["Each kind", *_rows(verdicts.kinds, changes)],
        ["Every joint", *_rows(verdicts.joints, changes)],
        [f"Impulse of the normal force per {per}", *_feet(verdicts)],
        [*LEGEND, *verdicts.notes, *(f"assumed: {line}" for line in verdicts.assumed)],
    )
    return "\n\n".join("\n".join(part) for part in parts)


def _change_line(row: Recomputation) -> str:
    """Return what a change was, or why there is none."""
    if row.unneeded:
        return f"{row.title}: {row.unneeded}"
    failed = f"; {row.failure}" if row.failure else ""
    return f"{row.title}: {row.change}{failed}"


def _rows(rows: Sequence[PeakVerdict], changes: Sequence[Recomputation]) -> list[str]:
    tried = [row for row in changes if not row.unneeded]
    header = ["", "verdict", "torque|[N m]", *(f"{row.name}|[%]" for row in tried)]
    header += ["p99|[N m]", "least to|largest", "RMS|[N m]", "least to|largest", "limit|[N m]"]
    cells = [
        [
            row.name,
            row.verdict,
            f"{row.torque.value:.4g}" if row.verdict == PEAK else _span(row.torque),
            *(_percent(row, change.name) for change in tried),
            f"{row.p99.value:.4g}",
            _span(row.p99),
            f"{row.rms.value:.4g}",
            _span(row.rms),
            f"{row.effort_limit:.4g}",
        ]
        for row in rows
    ]
    return aligned(header, cells)


def _percent(row: PeakVerdict, change: str) -> str:
    return f"{100.0 * row.changes[change]:+.1f}" if change in row.changes else "?"


def _span(spread: Spread) -> str:
    return f"{spread.low:.4g} to {spread.high:.4g}"


def _feet(verdicts: PeakVerdicts) -> list[str]:
    rows = [
        [row.foot, f"{row.impulse.value:.4g}", _span(row.impulse), f"{100 * row.impulse.share:.1f}"]
        for row in verdicts.feet
    ]
    return aligned(["foot", "impulse|[N s]", "least to|largest", "spread|[%]"], rows)
