"""What a printed report is made of, apart from how it is drawn: headings, tables, figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase

UNKNOWN = "unknown"
"""Stands for every number that nobody knows."""


class Cell(NamedTuple):
    """A cell of a table.

    Attributes:
        text: plain text.
        mark: "" or "bad" (outside what is allowed) or "good".
    """

    text: str
    mark: str = ""


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        title: with its unit.
        wide: whether it holds texts that may be broken into lines; others hold short words and
            numbers, and are aligned to the right.
    """

    title: str
    wide: bool = False


@dataclass(frozen=True)
class Title:
    """The report's title."""

    text: str


@dataclass(frozen=True)
class Heading:
    """The title of a section."""

    text: str


@dataclass(frozen=True)
class Paragraph:
    """A paragraph; in small print where `small`."""

    text: str
    small: bool = False


@dataclass(frozen=True)
class Verdict:
    """The result, in a frame.

    Attributes:
        word: one word, such as "PASSES".
        texts: sentences, one paragraph each.
        level: "good", "open" (not all is known) or "bad".
    """

    word: str
    texts: tuple[str, ...]
    level: str


@dataclass(frozen=True)
class Facts:
    """Labels and what belongs to them."""

    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Items:
    """A list in small print."""

    texts: tuple[str, ...]


@dataclass(frozen=True)
class SignatureFields:
    """Empty fields to be filled in by hand."""

    labels: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        columns: titles.
        rows: as many cells each.
        groups: titles above the columns, with how many columns each spans; empty for none.
        note: what to know to read it, below it.
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    groups: tuple[tuple[str, int], ...] = ()
    note: str = ""


@dataclass(frozen=True)
class Picture:
    """A figure.

    Attributes:
        draw: draws it into a figure or a part of one, whose layout is "constrained".
        height: of its drawing over a width of `WIDTH` [inch].
        caption: below it.
    """

    draw: Callable[[FigureBase], None] = field(repr=False)
    height: float
    caption: str


LEVELS = {
    "good": ("#2e6b34", "#f2f8f2"),
    "open": ("#8a6100", "#fdf8ec"),
    "bad": ("#9c1f17", "#fbf2f1"),
}
"""Colours of a verdict's frame: edge and ground."""

WIDTH = 7.3
"""Width of figures: that between the margins of a page of A4 [inch]."""

Block = (
    Title | Heading | Paragraph | Verdict | Facts | Items | SignatureFields | Table | Picture
)  # fmt: skip
Blocks = Sequence[Block]


def number(value: float | None, digits: int = 3) -> str:
    """Return a number as text: `digits` significant ones, "unknown" of None and NaN."""
    if value is None or math.isnan(value):
        return UNKNOWN
    if math.isinf(value):
        return "∞" if value > 0.0 else "-∞"
    if value != 0.0 and 1.0 <= abs(value) < 1e6:
        return f"{value:.{max(0, digits - 1 - math.floor(math.log10(abs(value))))}f}"
    return f"{value:.{digits}g}"


def with_unit(value: float | None, unit: str, digits: int = 3) -> str:
    """Return a number with its unit; "unknown" alone of None and NaN."""
    text = number(value, digits)
    return text if text == UNKNOWN else f"{text} {unit}"


def use_text(use: float) -> str:
    """Return need over allowed: two decimals, none above 10, enough of them near 1."""
    if math.isnan(use) or math.isinf(use):
        return number(use)
    if use != 1.0 and abs(use - 1.0) < 0.01:  # never "1.00" of what is not 1
        return f"{use:.{min(-math.floor(math.log10(abs(use - 1.0))), 9)}f}"
    return f"{use:.2f}" if use < 10.0 else f"{use:.0f}"


def margin_text(use: float) -> str:
    """Return how much of what is allowed is left, 1 - use, as a percentage."""
    if math.isnan(use):
        return UNKNOWN
    if math.isinf(use):
        return "-∞"
    left = 100.0 * (1.0 - use)
    return f"{left:.1f} %" if abs(left) < 10.0 else f"{left:.0f} %"
