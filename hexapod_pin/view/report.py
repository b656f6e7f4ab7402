"""A report is a list of blocks (texts, tables, figures), written as an HTML page or a PDF file."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from hexapod_pin.errors import MissingPackageError
from hexapod_pin.foreign_text import encoded
from hexapod_pin.view.figure_file import figure_bytes, require_matplotlib, settle_layout

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase

    from hexapod_pin.view.report_pdf import Paper

WIDTH = 7.3
"""Width of figures: that between the margins of a page of A4 [inch]."""

DPI = 200
"""Of figures in a PDF file, and of the rasterized parts of those in a page."""

WITH_TABLE, WITH_TEXT = 110.0, 40.0
"""Room on paper for what introduces a table, with its first rows, and for any other block [pt]."""

LEVELS = {
    "good": ("#2e6b34", "#f2f8f2"),
    "open": ("#8a6100", "#fdf8ec"),
    "bad": ("#9c1f17", "#fbf2f1"),
}
"""Colours of a verdict's frame: edge and ground."""

SHORT = 24
"""Texts of so many characters are not broken into lines in a table of a page."""

DENSE = 12
"""Columns above which a table of a page is in small print."""

STYLE = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "hatch.linewidth": 0.5,
    "svg.hashsalt": "hexapod-pin",
}
"""Of matplotlib, over its defaults: a user's own settings do not change a report."""


class Block(Protocol):
    """A part of a report."""

    def html(self) -> str:
        """Return the element of a page; all its texts are escaped."""

    def print(self, paper: Paper) -> None:
        """Print it below what is on paper so far."""


def require_report(report: str, ending: str) -> None:
    """Refuse a report, before anything is computed for it, where a package is missing.

    Args:
        report: its name, for the message.
        ending: of its file.

    Raises:
        MissingPackageError: matplotlib, or fpdf2 for a PDF file, is not installed.
    """
    require_matplotlib(report)
    if ending == ".pdf":
        try:
            import fpdf  # noqa: F401
        except ImportError as error:
            raise MissingPackageError("fpdf2", "plot", report) from error


def report_bytes(blocks: Sequence[Block], ending: str) -> bytes:
    """Return the file of a report; the same blocks give the same bytes.

    Args:
        blocks: the first `Title` among them is that of the file, too.
        ending: ".pdf": pages of A4; another: an HTML page that needs no other file.

    Raises:
        MissingPackageError: matplotlib, or fpdf2 for a PDF file, is not installed.
    """
    require_report(f"a report as {ending}", ending)
    import matplotlib

    style: Any = STYLE
    title = next((block.text for block in blocks if isinstance(block, Title)), "Report")
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(style)
        if ending == ".pdf":
            return _printed(title, blocks)
        body = "\n".join(block.html() for block in blocks)
        return encoded(_PAGE.format(title=escape(title), style=_CSS, body=body))


def _printed(title: str, blocks: Sequence[Block]) -> bytes:
    """Return the PDF file of a report."""
    from hexapod_pin.view.report_pdf import Paper

    with closing(Paper(title)) as paper:
        for block, after in zip(blocks, (*blocks[1:], None), strict=True):
            if not isinstance(block, Table):
                paper.room(WITH_TABLE if isinstance(after, Table) else WITH_TEXT)
            block.print(paper)
        return bytes(paper.output())


@dataclass(frozen=True)
class Title:
    """The report's title."""

    text: str

    def html(self) -> str:
        """Return a heading of the first level."""
        return f"<h1>{escape(self.text)}</h1>"

    def print(self, paper: Paper) -> None:
        """Print the title."""
        paper.title_line(self.text)


@dataclass(frozen=True)
class Heading:
    """The title of a section."""

    text: str

    def html(self) -> str:
        """Return a heading of the second level."""
        return f"<h2>{escape(self.text)}</h2>"

    def print(self, paper: Paper) -> None:
        """Print it with a line below, and list it in the file's outline."""
        paper.heading(self.text)


@dataclass(frozen=True)
class Paragraph:
    """A paragraph; in small print where `small`."""

    text: str
    small: bool = False

    def html(self) -> str:
        """Return a paragraph."""
        small = ' class="small"' if self.small else ""
        return f"<p{small}>{escape(self.text)}</p>"

    def print(self, paper: Paper) -> None:
        """Print the text."""
        paper.paragraph(self.text, small=self.small)


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

    def html(self) -> str:
        """Return a coloured box."""
        edge, ground = LEVELS[self.level]
        texts = "".join(f"<p>{escape(text)}</p>" for text in self.texts)
        style = f"border-color: {edge}; background: {ground}"
        return f'<div class="verdict" style="{style}"><b>{escape(self.word)}</b>{texts}</div>'

    def print(self, paper: Paper) -> None:
        """Print a coloured box."""
        paper.box(self.word, self.texts, *LEVELS[self.level])


@dataclass(frozen=True)
class Facts:
    """Labels and what belongs to them."""

    rows: tuple[tuple[str, str], ...]

    def html(self) -> str:
        """Return a list of terms."""
        rows = (f"<dt>{escape(a)}</dt><dd>{escape(b)}</dd>" for a, b in self.rows)
        return f"<dl>{''.join(rows)}</dl>"

    def print(self, paper: Paper) -> None:
        """Print labels and texts side by side."""
        paper.pairs(self.rows, 120.0)


@dataclass(frozen=True)
class Items:
    """A list in small print."""

    texts: tuple[str, ...]

    def html(self) -> str:
        """Return a list."""
        return "<ul>" + "".join(f"<li>{escape(text)}</li>" for text in self.texts) + "</ul>"

    def print(self, paper: Paper) -> None:
        """Print a list."""
        paper.pairs([("•", text) for text in self.texts], 13.0, small=True)


@dataclass(frozen=True)
class SignatureFields:
    """Empty fields to be filled in by hand."""

    labels: tuple[str, ...]

    def html(self) -> str:
        """Return lines to sign on."""
        fields = (f"<div>{escape(label)}, date</div>" for label in self.labels)
        return f'<div class="sign">{"".join(fields)}</div>'

    def print(self, paper: Paper) -> None:
        """Print lines to sign on."""
        paper.signatures([f"{label}, date" for label in self.labels])


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
        wide: whether its texts may be broken into lines; others hold short words and
            numbers, and are aligned to the right.
    """

    title: str
    wide: bool = False


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

    def html(self) -> str:
        """Return a table, and its note as a paragraph."""
        groups = "".join(f'<th colspan="{n}">{escape(t)}</th>' for t, n in self.groups)
        head = f'<tr class="groups">{groups}</tr>' if groups else ""
        wide = [' class="wide"' if column.wide else "" for column in self.columns]
        titles = (f"<th{w}>{escape(c.title)}</th>" for w, c in zip(wide, self.columns, strict=True))
        head += f"<tr>{''.join(titles)}</tr>"
        rows = (f"<tr>{''.join(map(_html_cell, self.columns, row))}</tr>" for row in self.rows)
        dense = ' class="dense"' if len(self.columns) > DENSE else ""
        table = f"<table{dense}><thead>{head}</thead><tbody>{''.join(rows)}</tbody></table>"
        note = Paragraph(self.note, small=True).html() if self.note else ""
        return f'<div class="scroll">{table}</div>{note}'

    def print(self, paper: Paper) -> None:
        """Print the table, its titles again on each page, and its note."""
        paper.grid(self.columns, self.rows, self.groups)
        if self.note:
            paper.paragraph(self.note, small=True)


def _html_cell(column: Column, cell: Cell) -> str:
    short = column.wide and len(cell.text) <= SHORT
    kinds = (cell.mark, "wide" * column.wide, "short" * short)
    return f'<td class="{" ".join(filter(None, kinds))}">{escape(cell.text)}</td>'


@dataclass(frozen=True)
class Picture:
    """A figure.

    Attributes:
        draw: draws it into a figure whose layout is "constrained".
        height: of its drawing over a width of `WIDTH` [inch].
        caption: below it.
    """

    draw: Callable[[FigureBase], None] = field(repr=False)
    height: float
    caption: str

    def html(self) -> str:
        """Return the drawing as SVG in the page itself."""
        data = base64.b64encode(self._drawn("svg", metadata={"Date": None})).decode("ascii")
        caption = escape(self.caption)
        return (
            f'<figure><img alt="{caption}" src="data:image/svg+xml;base64,{data}">'
            f"<figcaption>{caption}</figcaption></figure>"
        )

    def print(self, paper: Paper) -> None:
        """Print the drawing over the whole width."""
        paper.picture(io.BytesIO(self._drawn("png")), 72.0 * self.height, self.caption)

    def _drawn(self, ending: str, **options: Any) -> bytes:
        from matplotlib.figure import Figure

        figure = Figure(figsize=(WIDTH, self.height), layout="constrained")
        self.draw(figure)
        settle_layout(figure)
        return figure_bytes(figure, ending, dpi=DPI, **options)


_CSS = """
@page { size: A4; margin: 13mm 12mm; }
body { font: 10pt/1.4 "Helvetica Neue", Arial, "Liberation Sans", "DejaVu Sans", sans-serif;
  color: #1a1a1a; max-width: 200mm; margin: 10mm auto; padding: 0 5mm; }
h1 { font-size: 19pt; margin: 0 0 3mm; }
h2 { font-size: 12.5pt; margin: 7mm 0 2mm; padding-bottom: 1mm; border-bottom: 0.4mm solid #1a1a1a;
  break-after: avoid; overflow-wrap: anywhere; }
p { margin: 2mm 0; overflow-wrap: anywhere; }
p.small, ul { font-size: 8.5pt; color: #333; }
ul { margin: 1mm 0 3mm; padding-left: 5mm; overflow-wrap: anywhere; }
dl { display: grid; grid-template-columns: 42mm 1fr; gap: 0.8mm 3mm; margin: 2mm 0; }
dt { color: #555; } dd { margin: 0; overflow-wrap: anywhere; }
.verdict { border: 0.5mm solid; border-left-width: 2.5mm; padding: 2mm 4mm; margin: 4mm 0;
  break-inside: avoid; }
.verdict b { font-size: 12.5pt; letter-spacing: 0.3pt; }
.verdict p, .verdict b { color: #1a1a1a; }
.scroll { overflow-x: auto; margin: 2mm 0; }
table { border-collapse: collapse; font-size: 8pt; line-height: 1.25; width: 100%; }
thead { display: table-header-group; }
tr { break-inside: avoid; }
th { text-align: right; vertical-align: bottom; font-weight: 600; padding: 0.6mm 1.2mm;
  border-bottom: 0.3mm solid #1a1a1a; }
tr.groups th { text-align: center; border-bottom: 0.2mm solid #888; }
tr.groups th:empty { border-bottom: 0; }
td { text-align: right; vertical-align: top; padding: 0.6mm 1.2mm; white-space: nowrap;
  border-bottom: 0.15mm solid #ccc; font-variant-numeric: tabular-nums; }
th.wide, td.wide { text-align: left; white-space: normal; overflow-wrap: break-word; }
table.dense { font-size: 6.6pt; }
table.dense th, table.dense td { padding-left: 0.6mm; padding-right: 0.6mm; }
td.short { white-space: nowrap; }
td.bad { color: #9c1f17; font-weight: 700; }
td.good { color: #2e6b34; }
figure { margin: 4mm 0; break-inside: avoid; }
figure img { width: 100%; display: block; }
figcaption { font-size: 8.5pt; color: #333; margin-top: 1mm; overflow-wrap: anywhere; }
.sign { display: grid; grid-template-columns: repeat(3, 1fr); gap: 8mm; margin: 14mm 0 4mm;
  break-inside: avoid; }
@media print {
  body { margin: 0; padding: 0; max-width: none; font-size: 8.5pt; }
  p.small, ul, figcaption { font-size: 7pt; }
  table { font-size: 7pt; }
  table.dense { font-size: 5.8pt; }
  .scroll { overflow: visible; }
  .verdict, td, th { print-color-adjust: exact; }
}
.sign div { border-top: 0.3mm solid #1a1a1a; padding-top: 1mm; font-size: 8.5pt; }
"""

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
{body}
</body>
</html>
"""
