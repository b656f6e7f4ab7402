"""A comparison on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hexapod_pin.benchmark.comparison import Comparison
from hexapod_pin.benchmark.report import facts
from hexapod_pin.benchmark.tables import Table, has_peers, tables

if TYPE_CHECKING:
    from rich.console import Console

WIDTH = 150
"""Columns where the output is no terminal."""


def console() -> Console:
    """Return stdout as rich sees it, wide enough where it is a file or a pipe."""
    from rich.console import Console

    out = Console(highlight=False)
    return out if out.is_terminal else Console(highlight=False, width=WIDTH)


def show(comparison: Comparison, out: Console) -> None:
    """Print a scene's facts, tables and ratios."""
    out.print(f"\n[bold]{comparison.task.name}[/bold]")
    for line in facts(comparison):
        out.print(f"- {line}", markup=False, soft_wrap=True)
    *levels, runs = tables(comparison)
    for table in (runs, *levels):
        show_table(table, out)
    if has_peers(comparison):
        for line in comparison.ratios:
            out.print(line, markup=False, soft_wrap=True)


def show_table(table: Table, out: Console) -> None:
    """Print a table; text columns left, numbers right."""
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    drawn = RichTable(title=Text(table.title), box=box.SIMPLE_HEAD, title_justify="left")
    for name in table.head:
        left = name in ("method", "setting", "note")
        drawn.add_column(Text(name), justify="left" if left else "right", no_wrap=name != "note")
    for row in table.rows:
        drawn.add_row(*(Text(cell) for cell in row))
    out.print(drawn)
