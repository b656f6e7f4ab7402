"""A report is a page of blocks: a header, texts, sortable tables, figures.

It prints as pages of A4: a browser makes the PDF file of it.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from hexapod_pin.foreign_text import encoded
from hexapod_pin.view.figure_file import figure_bytes, require_matplotlib, settle_layout

if TYPE_CHECKING:
    from matplotlib.figure import Figure, FigureBase

    from hexapod_pin.text_table import Table as TextTable

WIDTH = 7.3
"""Width of figures: that between the margins of a page of A4 [inch]."""

DPI = 200
"""Of the rasterized parts of figures."""

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


def report_bytes(blocks: Sequence[Block]) -> bytes:
    """Return the page of a report, which needs no other file; the same blocks give the same bytes.

    Args:
        blocks: the title of the first `Header` among them is that of the page.

    Raises:
        MissingPackageError: matplotlib is not installed.
    """
    require_matplotlib("a report")
    import matplotlib

    style: Any = STYLE
    title = next((block.title for block in blocks if isinstance(block, Header)), "Report")
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(style)
        body = "\n".join(block.html() for block in blocks)
    page = _PAGE.format(title=escape(title), style=_CSS, body=body, script=_SCRIPT)
    return encoded(page)


@dataclass(frozen=True)
class Heading:
    """The title of a section."""

    text: str

    def html(self) -> str:
        """Return a heading of the second level."""
        return f"<h2>{escape(self.text)}</h2>"


@dataclass(frozen=True)
class Paragraph:
    """A paragraph; in small print where `small`."""

    text: str
    small: bool = False

    def html(self) -> str:
        """Return a paragraph."""
        small = ' class="small"' if self.small else ""
        return f"<p{small}>{escape(self.text)}</p>"


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


@dataclass(frozen=True)
class Facts:
    """Labels and what belongs to them."""

    rows: tuple[tuple[str, str], ...]

    def html(self) -> str:
        """Return a list of terms."""
        rows = (f"<dt>{escape(a)}</dt><dd>{escape(b)}</dd>" for a, b in self.rows)
        return f"<dl>{''.join(rows)}</dl>"


@dataclass(frozen=True)
class Header:
    """What every report begins with: title, verdict, what was run, and how to make it again.

    Attributes:
        title: of the page.
        verdict: the result; None where there is none.
        robot: name and mass.
        gait: what it walks.
        motor: what its joints are driven by.
        contact: laws of the feet on the ground.
        accuracy: of the numbers, and the method.
        more: further labels and texts.
        date: as it is printed.
        command: that makes the report again.
    """

    title: str
    verdict: Verdict | None = None
    robot: str = ""
    gait: str = ""
    motor: str = ""
    contact: str = ""
    accuracy: str = ""
    more: tuple[tuple[str, str], ...] = ()
    date: str = ""
    command: str = ""

    @property
    def facts(self) -> tuple[tuple[str, str], ...]:
        """Labels and texts in the order of the page; what is not stated is left out."""
        rows = (
            ("Robot", self.robot), ("Gait", self.gait), ("Motor", self.motor),
            ("Contact", self.contact), ("Accuracy", self.accuracy), *self.more,
            ("Date", self.date), ("Version", f"hexapod-pin {version('hexapod-pin')}"),
        )  # fmt: skip
        return tuple((label, text) for label, text in rows if text)

    def html(self) -> str:
        """Return title, verdict and a list of terms; the command has a button that copies it."""
        rows = "".join(f"<dt>{escape(a)}</dt><dd>{escape(b)}</dd>" for a, b in self.facts)
        if self.command:
            copy = '<button class="copy" type="button" hidden>copy</button>'
            rows += f"<dt>Command</dt><dd><code>{escape(self.command)}</code> {copy}</dd>"
        verdict = "" if self.verdict is None else self.verdict.html()
        return f"<header><h1>{escape(self.title)}</h1>{verdict}<dl>{rows}</dl></header>"


@dataclass(frozen=True)
class Items:
    """A list in small print."""

    texts: tuple[str, ...]

    def html(self) -> str:
        """Return a list."""
        return "<ul>" + "".join(f"<li>{escape(text)}</li>" for text in self.texts) + "</ul>"


@dataclass(frozen=True)
class SignatureFields:
    """Empty fields to be filled in by hand."""

    labels: tuple[str, ...]

    def html(self) -> str:
        """Return lines to sign on."""
        fields = (f"<div>{escape(label)}, date</div>" for label in self.labels)
        return f'<div class="sign">{"".join(fields)}</div>'


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
    """A table, which a click on a title sorts.

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

    @classmethod
    def of(cls, table: TextTable) -> Table:
        """Return a table of texts and numbers as one of a page; its first column may be broken."""
        titles = [title.replace("\n", " ") for title in table.head]
        columns = (Column(title, wide=k == 0) for k, title in enumerate(titles))
        rows = (tuple(map(Cell, row)) for row in table.texts())
        return cls(tuple(columns), tuple(rows))

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
        from matplotlib.figure import Figure

        figure = Figure(figsize=(WIDTH, self.height), layout="constrained")
        self.draw(figure)
        return _figure(figure, self.caption)


@dataclass(frozen=True)
class Drawing:
    """A figure of the functions that draw figures of results.

    Attributes:
        make: returns it.
        caption: below it.
    """

    make: Callable[[], Figure] = field(repr=False)
    caption: str

    def html(self) -> str:
        """Return the drawing as SVG in the page itself."""
        return _figure(self.make(), self.caption)


def _figure(figure: Figure, caption: str) -> str:
    settle_layout(figure)
    data = figure_bytes(figure, "svg", dpi=DPI, metadata={"Date": None})
    source = base64.b64encode(data).decode("ascii")
    text = escape(caption)
    return (
        f'<figure><img alt="{text}" src="data:image/svg+xml;base64,{source}">'
        f"<figcaption>{text}</figcaption></figure>"
    )


_CSS = """
@page { size: A4; margin: 13mm 12mm 16mm;
  @bottom-right { content: "page " counter(page) " of " counter(pages); font: 7pt sans-serif; } }
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
th[role] { cursor: pointer; }
th[role]:hover, th[role]:focus { text-decoration: underline; }
th[aria-sort]::after { content: " \25B2"; font-size: 70%; }
th[aria-sort=descending]::after { content: " \25BC"; }
code { font-family: "DejaVu Sans Mono", monospace; font-size: 90%; }
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
  button { display: none; }
  th[aria-sort]::after { content: none; }
  h1, h2 { break-after: avoid; }
  body { margin: 0; padding: 0; max-width: none; font-size: 8.5pt; }
  p.small, ul, figcaption { font-size: 7pt; }
  table { font-size: 7pt; }
  table.dense { font-size: 5.8pt; }
  .scroll { overflow: visible; }
  .verdict, td, th { print-color-adjust: exact; }
}
.sign div { border-top: 0.3mm solid #1a1a1a; padding-top: 1mm; font-size: 8.5pt; }
"""

_SCRIPT = """const key = (text) => {
  if (text.startsWith("\u221e")) return Infinity;
  const number = parseFloat(text.replace(/^([-+]?)\u2212/, "$1-"));
  return Number.isNaN(number) ? text : number;
};
function compare(a, b, way) {  // numbers first, either way: a dash is no number
  if (typeof a !== typeof b) return typeof a === "number" ? -1 : 1;
  return a < b ? -way : a > b ? way : 0;
}
for (const table of document.querySelectorAll("table")) {
  const body = table.tBodies[0], titles = [...table.tHead.rows[table.tHead.rows.length - 1].cells];
  if (body.rows.length < 2) continue;
  titles.forEach((title, column) => {
    const sort = () => {
      const way = title.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      for (const other of titles) other.removeAttribute("aria-sort");
      title.setAttribute("aria-sort", way > 0 ? "ascending" : "descending");
      const of = (row) => key(row.cells[column].textContent.trim());
      body.append(...[...body.rows].sort((a, b) => compare(of(a), of(b), way)));
    };
    title.tabIndex = 0;
    title.setAttribute("role", "columnheader button");
    title.title = "sort";
    title.onclick = sort;
    title.onkeydown = (event) => { if (event.key === "Enter") sort(); };
  });
}
for (const button of document.querySelectorAll("button.copy")) {
  button.hidden = false;
  button.onclick = () => {
    const range = document.createRange();
    range.selectNodeContents(button.previousElementSibling);
    getSelection().removeAllRanges();
    getSelection().addRange(range);
    document.execCommand("copy");
    button.textContent = "copied";
  };
}
"""

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
{body}
<script>
{script}</script>
</body>
</html>
"""
