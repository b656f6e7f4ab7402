"""Blocks of a report are set as text in columns on the sheets of a PDF file."""

from __future__ import annotations

import io
from functools import cache
from typing import TYPE_CHECKING, Any

from hexapod_pin.foreign_text import visible
from hexapod_pin.view.figure_file import plain_texts, settle_layout
from hexapod_pin.view.report_blocks import Cell, Column, Table

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure, FigureBase
    from matplotlib.ft2font import FT2Font


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


# Pages of A4 that fill from top to bottom: texts, lines and figures at places in points.

PAGE = (595.28, 841.89)
"""A4 [pt]."""

LEFT, TOP, BOTTOM = 34.8, 36.0, 44.0
"""Margins [pt]; the right one is as the left."""

ACROSS = PAGE[0] - 2.0 * LEFT
"""Width between the margins [pt]."""

INK = "#1a1a1a"
INCH = 72.0


class Sheets:
    """Pages, the last of which is being filled.

    Attributes:
        pages: so far.
        y: how far the last page is filled, from its top [pt].
    """

    def __init__(self) -> None:
        """Begin the first page."""
        self.pages: list[Figure] = []
        self.y = TOP
        self.turn()

    def turn(self) -> None:
        """Begin a new page."""
        from matplotlib.figure import Figure

        self.pages.append(Figure(figsize=(PAGE[0] / INCH, PAGE[1] / INCH)))
        self.y = TOP

    def room(self, height: float) -> bool:
        """Begin a new page unless the last has room for a height [pt]; tell whether one began."""
        if self.y + height <= PAGE[1] - BOTTOM or self.y <= TOP:
            return False
        self.turn()
        return True

    def line(self, y: float, left: float, right: float, width: float, color: str = INK) -> None:
        """Draw a horizontal line at y from the page's top [pt]."""
        from matplotlib.lines import Line2D

        x = [left / PAGE[0], right / PAGE[0]]
        self.pages[-1].add_artist(Line2D(x, [1.0 - y / PAGE[1]] * 2, lw=width, color=color))

    def frame(self, top: float, bottom: float, edge: str, fill: str) -> None:
        """Draw a frame over the whole width, behind what is drawn later [pt]."""
        from matplotlib.patches import Rectangle

        corner = (LEFT / PAGE[0], 1.0 - bottom / PAGE[1])
        size = (ACROSS / PAGE[0], (bottom - top) / PAGE[1])
        box = Rectangle(corner, *size, ec=edge, fc=fill, lw=1.5, zorder=-1)
        self.pages[-1].add_artist(box)

    def write(
        self, x: float, y: float, text: str, size: float, *,
        bold: bool = False, color: str = INK, align: str = "left",
    ) -> None:  # fmt: skip
        """Write one line whose base is at y [pt]."""
        self.pages[-1].text(
            x / PAGE[0], 1.0 - y / PAGE[1], visible(text), fontsize=size, color=color, ha=align,
            va="baseline", weight="bold" if bold else "normal", parse_math=False,
        )  # fmt: skip

    def paragraph(
        self, text: str, size: float, *, left: float = LEFT, width: float = ACROSS,
        bold: bool = False, color: str = INK,
    ) -> None:  # fmt: skip
        """Write a text in as many lines as it takes, over pages."""
        for line in wrapped(text, width, size, bold):
            self.room(LEADING * size)
            self.y += LEADING * size
            self.write(left, self.y - 0.28 * size, line, size, bold=bold, color=color)

    def figure(self, height: float, draw: Callable[[FigureBase], None]) -> None:
        """Draw a figure of a height [pt] over the whole width."""
        self.room(height)
        page = self.pages[-1]
        page.set_layout_engine("constrained")
        grid = page.add_gridspec(
            3, 3, width_ratios=(LEFT, ACROSS, LEFT),
            height_ratios=(self.y, height, max(PAGE[1] - self.y - height, 1e-3)),
        )  # fmt: skip
        draw(page.add_subfigure(grid[1, 1]))
        self.y += height

    def pdf(self, footer: str) -> bytes:
        """Return the pages as a file, each with a footer and its number."""
        from matplotlib.backends.backend_pdf import PdfPages

        stream = io.BytesIO()
        metadata = {"Title": visible(footer), "CreationDate": None, "ModDate": None}
        count = len(self.pages)
        with PdfPages(stream, metadata=metadata) as file:
            for number, page in enumerate(self.pages, start=1):
                base = 1.0 - (PAGE[1] - 22.0) / PAGE[1]
                style: Any = {"fontsize": 7.0, "color": "#555555", "parse_math": False}
                page.text(LEFT / PAGE[0], base, wrapped(footer, 400.0, 7.0)[0], **style)
                page.text(1.0 - LEFT / PAGE[0], base, f"page {number} of {count}", ha="right",
                          **style)  # fmt: skip
                settle_layout(page)
                with plain_texts(page):
                    file.savefig(page, dpi=200)
        return stream.getvalue()


# Texts on a page of paper: their width, and lines that fit.

LEADING = 1.28
"""Distance of lines over the size of the type [-]."""


SCALE = 100.0
"""Size at which letters are measured [pt]."""


def text_width(text: str, size: float, bold: bool = False) -> float:
    """Return the width of a text in the report's type, kerning left out [pt].

    Args:
        text: one line.
        size: of the type [pt].
        bold: whether it is bold.
    """
    return _width(visible(text), size, bold)


def _width(text: str, size: float, bold: bool) -> float:
    return size * sum(_advance(letter, bold) for letter in text)


@cache
def _advance(letter: str, bold: bool) -> float:
    """Return the width of a letter over the size of its type [-]."""
    glyph = _font(bold).load_char(ord(letter))
    return float(glyph.linearHoriAdvance) / 65536.0 / SCALE


@cache
def _font(bold: bool) -> FT2Font:
    from matplotlib.font_manager import FontProperties, findfont
    from matplotlib.ft2font import FT2Font

    name = findfont(FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal"))
    font = FT2Font(name)
    font.set_size(SCALE, 72)
    return font


def wrapped(text: str, width: float, size: float, bold: bool = False) -> list[str]:
    """Return a text in lines of at most this width [pt]; longer words are broken."""
    lines = [""]
    for word in visible(text).split():
        for piece in _pieces(word, width, size, bold):
            longer = f"{lines[-1]} {piece}".strip()
            if lines[-1] and _width(longer, size, bold) > width:
                lines.append(piece)
            else:
                lines[-1] = longer
    return lines


def _pieces(word: str, width: float, size: float, bold: bool) -> list[str]:
    """Return a word, or the parts of it that fit into a line."""
    if _width(word, size, bold) <= width:
        return [word]
    pieces = [""]
    for letter in word:
        if pieces[-1] and _width(pieces[-1] + letter, size, bold) > width:
            pieces.append(letter)
        else:
            pieces[-1] += letter
    return pieces
