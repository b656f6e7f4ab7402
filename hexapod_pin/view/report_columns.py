"""A table on pages of paper: widths of columns, lines of cells, a header on every page."""

from __future__ import annotations

from hexapod_pin.view.report_blocks import Cell, Column, Table
from hexapod_pin.view.report_sheet import ACROSS, BOTTOM, LEFT, PAGE, Sheets
from hexapod_pin.view.report_text import LEADING, text_width, wrapped

PAD = 3.0
"""Room on either side of a cell [pt]."""

SIZES = (7.0, 6.5, 6.0, 5.5, 5.0, 4.5)
"""Sizes of type, of which the first is taken that fits [pt]."""

SHORT = 100.0
"""Width that a column of texts has where its texts are as wide [pt]."""

TOGETHER = 4
"""Rows that stay with the titles of their table."""

COLORS = {"bad": "#9c1f17", "good": "#2e6b34", "": "#1a1a1a"}


def draw_table(sheets: Sheets, table: Table) -> None:
    """Draw a table, over pages."""
    size, widths = fitted(table)
    titles = tuple(Cell(column.title) for column in table.columns)
    head = _lines(titles, widths, size, True)
    depth = max(map(len, head))
    head = [[""] * (depth - len(lines)) + lines for lines in head]
    sheets.room(_start(table, head, widths, size))
    first = True
    for row in table.rows:
        lines = _lines(row, widths, size, False)
        height = _height(lines, size)
        above = _height(head, size) + (LEADING * size + 4.0 if table.groups else 0.0)
        if first or sheets.y + height > PAGE[1] - BOTTOM:
            sheets.room(height + above)
            _draw_head(sheets, table, head, widths, size)
            first = False
        _draw_row(sheets, table.columns, row, lines, widths, size)
    sheets.y += 3.0


def _start(table: Table, head: list[list[str]], widths: list[float], size: float) -> float:
    """Return the height of a table's titles and first rows, which are not parted [pt]."""
    rows = [_height(_lines(row, widths, size, False), size) for row in table.rows[:TOGETHER]]
    above = _height(head, size) + 2.0 * LEADING * size
    return min(above + sum(rows), 0.25 * PAGE[1])


def fitted(table: Table) -> tuple[float, list[float]]:
    """Return the size of type and the widths of columns that fill the page's width [pt]."""
    for size in SIZES:
        least = [_least(table, k, size) for k in range(len(table.columns))]
        if sum(least) <= ACROSS:
            break
    else:
        least = [width * ACROSS / sum(least) for width in least]
    wide = [k for k, column in enumerate(table.columns) if column.wide]
    whole = {k: _whole(table, k, size) for k in wide}
    spare = ACROSS - sum(least)
    wanted = {k: max(whole[k] - least[k], 0.0) for k in wide}
    mean = {k: _mean(table, k, size) for k in wide}
    share = spare / (sum(mean.values()) or 1.0)
    more = {k: min(wanted[k], share * mean[k]) for k in wide}
    widths = [x + more.get(k, 0.0) for k, x in enumerate(least)]
    rest = max(ACROSS - sum(widths), 0.0) / len(widths)
    return size, [width + rest for width in widths]


def _least(table: Table, k: int, size: float) -> float:
    """Return the least width of a column: of numbers whole, of texts their words."""
    column, title = table.columns[k], table.columns[k].title.split()
    heads = [text_width(word, size, True) for word in title]
    if not column.wide:
        texts = [text_width(row[k].text, size, bool(row[k].mark)) for row in table.rows]
        return max([*heads, *texts, 0.0]) + 2.0 * PAD
    words = [text_width(w, size) for row in table.rows for w in row[k].text.split()]
    return min(max([*heads, *words, _whole(table, k, size)]), SHORT) + 2.0 * PAD


def _whole(table: Table, k: int, size: float) -> float:
    """Return the width of a column whose texts are not broken."""
    texts = [text_width(row[k].text, size, row[k].mark == "bad") for row in table.rows]
    return max([*texts, 0.0]) + 2.0 * PAD


def _mean(table: Table, k: int, size: float) -> float:
    """Return the mean width of a column's texts: what the heights of rows depend on."""
    texts = [text_width(row[k].text, size) for row in table.rows]
    return sum(texts) / max(len(texts), 1)


def _lines(row: tuple[Cell, ...], widths: list[float], size: float, bold: bool) -> list[list[str]]:
    return [
        wrapped(cell.text, width - 2.0 * PAD + 0.01, size, bold or cell.mark == "bad")
        for cell, width in zip(row, widths, strict=True)
    ]


def _height(lines: list[list[str]], size: float) -> float:
    return LEADING * size * max(map(len, lines)) + 3.0


def _draw_head(
    sheets: Sheets, table: Table, head: list[list[str]], widths: list[float], size: float
) -> None:
    """Draw the titles of groups and of columns."""
    if table.groups:
        _draw_groups(sheets, table, widths, size)
    titles = tuple(Cell("") for _ in table.columns)
    _draw_row(sheets, table.columns, titles, head, widths, size, bold=True)


def _draw_groups(sheets: Sheets, table: Table, widths: list[float], size: float) -> None:
    left, first = LEFT, 0
    for title, count in table.groups:
        right = left + sum(widths[first : first + count])
        if title:
            short = wrapped(title, right - left, size, True)[0]
            sheets.write(0.5 * (left + right), sheets.y + size, short, size, bold=True,
                         align="center")  # fmt: skip
            sheets.line(sheets.y + LEADING * size + 2.0, left + PAD, right - PAD, 0.4, "#888888")
        left, first = right, first + count
    sheets.y += LEADING * size + 4.0


def _draw_row(
    sheets: Sheets,
    columns: tuple[Column, ...],
    row: tuple[Cell, ...],
    lines: list[list[str]],
    widths: list[float],
    size: float,
    *,
    bold: bool = False,
) -> None:
    """Draw a row and the line below it; a row higher than a page goes over pages."""
    left, top = LEFT, sheets.y
    for column, cell, texts, width in zip(columns, row, lines, widths, strict=True):
        x = left + PAD if column.wide else left + width - PAD
        for k, text in enumerate(texts):
            y = top + LEADING * size * (k + 1)
            sheets.write(
                x, y - 0.1 * size, text, size, bold=bold or cell.mark == "bad",
                color=COLORS[cell.mark], align="left" if column.wide else "right",
            )  # fmt: skip
        left += width
    sheets.y = top + _height(lines, size)
    sheets.line(
        sheets.y, LEFT, LEFT + ACROSS, 0.8 if bold else 0.3, "#1a1a1a" if bold else "#bbbbbb"
    )
