"""A table as text: aligned columns for a terminal, or Markdown."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

WIDTH = 80
"""Of a terminal: longest line that is not part of a table [characters]."""

Cell = str | float | None
"""A text stands as it is; a number is written in its table's format."""


@dataclass(frozen=True)
class Table:
    r"""A table of texts and numbers.

    Attributes:
        title: what it shows, with units; "" for none.
        head: names of the columns, with units; a line break parts a name into lines. Empty for
            none.
        rows: as many cells each.
        align: "<" (left) or ">" (right) for each column; the last sign holds for all that follow.
        rule: whether a line stands between head and rows.
        number: format of numbers that are no integers.
        missing: what stands for None and NaN.
        least: width of the narrowest column.

    Example:
        >>> print(Table("", ("joint", "peak\n[N m]"), [("coxa", 1.25)], align="<>").text(), end="")
                peak
        joint  [N m]
        ------------
        coxa    1.25
    """

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    align: str = "<"
    rule: bool = True
    number: str = ".4g"
    missing: str = "-"
    least: int = 0

    def texts(self) -> list[list[str]]:
        """Return the cells of all rows as they are written."""
        return [[cell_text(cell, self.number, self.missing) for cell in row] for row in self.rows]

    def lines(self) -> list[str]:
        """Return title, head and rows, with aligned columns two spaces apart."""
        names = [name.split("\n") for name in self.head]
        depth = max(map(len, names), default=0)
        names = [[""] * (depth - len(parts)) + parts for parts in names]
        cells = [*zip(*names, strict=True), *self.texts()]
        widths = [max(self.least, *map(len, column)) for column in zip(*cells, strict=True)]
        sides, most = self._sides(len(widths)), _columns.get()
        if most and _total(widths) > most:
            column, size = _foldable(widths, sides, most)
            if size:
                widths[column] = size
                head = [part for line in cells[:depth] for part in _in_column(line, column, size)]
                rows = [part for line in cells[depth:] for part in _in_column(line, column, size)]
                cells, depth = [*head, *rows], len(head)
        lines = list[str]()
        for part in _blocks(widths, most):
            lines += [""] * bool(lines) + self._block(cells, depth, widths, sides, part)
        return [self.title, *lines] if self.title else lines

    def _block(
        self, cells: Sequence[Sequence[str]], depth: int, widths: Sequence[int], sides: str,
        part: Sequence[int],
    ) -> list[str]:  # fmt: skip
        """Return the lines of some of the columns."""
        form = "  ".join(f"{{:{sides[k]}{widths[k]}}}" for k in part)
        lines = [form.format(*(line[k] for k in part)) for line in cells]
        if sides[part[-1]] == "<":
            lines = [line.rstrip() for line in lines]
        if self.rule and depth:
            lines.insert(depth, "-" * _total([widths[k] for k in part]))
        return lines

    def text(self) -> str:
        """Return `lines` as a text that ends with its last line."""
        return "".join(f"{line}\n" for line in self.lines())

    def markdown(self) -> str:
        """Return the table, without its title, as Markdown."""
        sides = ["---:" if side == ">" else "---" for side in self._sides(len(self.head))]
        lines = [list(self.head), sides, *self.texts()]
        return "".join(f"| {' | '.join(map(escaped, line))} |\n" for line in lines)

    def _sides(self, count: int) -> str:
        return self.align[:count].ljust(count, self.align[-1])


# Tables that are wider than the terminal: a column of texts is folded, or columns go below others.

_columns: ContextVar[int] = ContextVar("columns", default=0)

NARROWEST_TEXT = 24
"""Width to which a column of texts is folded at least [characters]."""


@contextmanager
def fit_tables(columns: int) -> Iterator[None]:
    """Make tables no wider than a number of characters, where they can be; 0: of any width."""
    token = _columns.set(columns)
    try:
        yield
    finally:
        _columns.reset(token)


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + 2 * (len(widths) - 1)


def _foldable(widths: Sequence[int], sides: str, most: int) -> tuple[int, int]:
    """Return the widest column of texts, and the width that it is to be folded to; 0: none."""
    texts = [k for k in range(len(widths)) if sides[k] == "<"]
    if not texts:
        return 0, 0
    widest = max(texts, key=lambda k: widths[k])
    size = most - (_total(widths) - widths[widest])
    return widest, size if size >= NARROWEST_TEXT else 0


def _in_column(line: Sequence[str], column: int, size: int) -> list[tuple[str, ...]]:
    """Return a line of a table in as many lines as one of its cells takes when folded."""
    begin = line[column][: len(line[column]) - len(line[column].lstrip())]
    parts = textwrap.wrap(
        line[column].strip(), size, initial_indent=begin, subsequent_indent=f"{begin}  "
    ) or [""]
    first = (*line[:column], parts[0], *line[column + 1 :])
    return [first, *(("",) * column + (x,) + ("",) * (len(line) - column - 1) for x in parts[1:])]


def _blocks(widths: Sequence[int], most: int) -> list[list[int]]:
    """Return the columns that stand beside each other; all begin with the first."""
    blocks = [list(range(min(2, len(widths))))] if widths else []
    for k in range(2, len(widths)):
        if most and _total([widths[j] for j in (*blocks[-1], k)]) > most:
            blocks.append([0, k])
        else:
            blocks[-1].append(k)
    return blocks


def cell_text(cell: Cell, number: str = ".4g", missing: str = "-") -> str:
    """Return a cell as it is written; the other arguments are as of a `Table`."""
    if isinstance(cell, str):
        return cell
    if cell is None or math.isnan(cell):
        return missing
    return str(cell) if isinstance(cell, int) else f"{cell:{number}}"


def labelled(
    rows: Sequence[tuple[str, Cell, str]], number: str = ".4g", missing: str = "-", least: int = 0
) -> list[str]:
    """Return a line for each label, value and unit, the values below one another.

    Args:
        rows: labels, values and units.
        number: format of values.
        missing: what stands for None and NaN.
        least: width of the narrowest label.
    """
    cells = [(label, f"{cell_text(value, number, missing)} {unit}") for label, value, unit in rows]
    return Table("", (), cells, least=least).lines()


def indented(lines: Sequence[str]) -> list[str]:
    """Return lines that stand in by two spaces."""
    return [f"  {line}" for line in lines]


def folded(text: str, indent: str = "") -> list[str]:
    """Return a text in lines of at most `WIDTH` characters, broken between words.

    Args:
        text: one paragraph.
        indent: of the first line; those that follow stand in by as much again.
    """
    return textwrap.wrap(
        text, WIDTH, initial_indent=indent, subsequent_indent=2 * indent,
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip


def escaped(text: str) -> str:
    """Return a text as a cell or line of Markdown."""
    return text.replace("|", "\\|").replace("\n", " ")
