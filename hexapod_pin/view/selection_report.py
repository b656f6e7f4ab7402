"""The report of a motor selection is an HTML page or a PDF file."""

from __future__ import annotations

import base64
import html
from functools import singledispatch
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError
from hexapod_pin.foreign_text import encoded
from hexapod_pin.results.result_files import check_ending
from hexapod_pin.view.figure_file import figure_bytes, require_matplotlib, settle_layout
from hexapod_pin.view.report_blocks import (
    LEVELS,
    WIDTH,
    Block,
    Blocks,
    Cell,
    Column,
    Facts,
    Heading,
    Items,
    Paragraph,
    Picture,
    SignatureFields,
    Table,
    Title,
    Verdict,
)

if TYPE_CHECKING:
    from hexapod_pin.results.motor_selection import MotorSelection


ENDINGS = (".html", ".htm", ".pdf")

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


@checked
def write_selection_report(
    selection: MotorSelection, path: str | Path, *, date: str | None = None
) -> Path:
    r"""Write the report of a motor selection, wholly or not at all, and return its path.

    An HTML page needs no network, no script and no other file; a PDF has pages of A4. Both hold
    the same: verdict, choice, ranking, figures, what was simulated, derating with its evidence,
    assumptions, data and sources of the motors. The same selection gives the same bytes.

    Args:
        selection: the result of `select_motors`.
        path: ends in .html or .pdf.
        date: printed as it is; None: none is printed.

    Raises:
        TraceFileError: another ending, or the file cannot be written.
        ParameterError: the selection has no motor to report on.
        MissingPackageError: matplotlib is not installed.

    Example:
        >>> found = select_motors('schema = 1\n[base]\nrobot = "kharagpur"')
        >>> write_selection_report(found, "motors.html")
    """
    ending = check_ending(path, ENDINGS)
    if not selection.candidates and selection.choice is None:
        raise ParameterError(
            "selection.candidates", 0, "one motor or more", "Choose motors of the catalogue."
        )
    return write_atomically(path, _content(selection, ending, date))


def _content(selection: MotorSelection, ending: str, date: str | None) -> bytes:
    from hexapod_pin.view.selection_sections import selection_blocks

    require_matplotlib("the report on a choice of motors")
    import matplotlib

    style: Any = STYLE
    blocks = tuple(selection_blocks(selection, date))
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(style)
        if ending == ".pdf":
            from hexapod_pin.view.selection_pdf import pdf_pages

            return pdf_pages(blocks)

        return html_page(blocks)


# A report as one HTML page that needs nothing else: text, tables, and figures as SVG.

SHORT = 24
"""Texts of so many characters are not broken into lines in a table."""

DENSE = 12
"""Columns above which a table is in small print."""

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"

_STYLE = """
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
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
{body}
</body>
</html>
"""


def html_page(blocks: Blocks) -> bytes:
    """Return a report as a page; all its texts are escaped.

    Raises:
        MissingPackageError: matplotlib is not installed.
    """
    title = next((block.text for block in blocks if isinstance(block, Title)), "Report")
    body = "\n".join(_element(block) for block in blocks)
    page = _PAGE.format(policy=_POLICY, title=html.escape(title), style=_STYLE, body=body)
    return encoded(page)


@singledispatch
def _element(block: Block) -> str:
    raise TypeError(type(block).__name__)


@_element.register
def _title(block: Title) -> str:
    return f"<h1>{html.escape(block.text)}</h1>"


@_element.register
def _heading(block: Heading) -> str:
    return f"<h2>{html.escape(block.text)}</h2>"


@_element.register
def _paragraph(block: Paragraph) -> str:
    kind = ' class="small"' if block.small else ""
    return f"<p{kind}>{html.escape(block.text)}</p>"


@_element.register
def _verdict(block: Verdict) -> str:
    edge, ground = LEVELS[block.level]
    texts = "".join(f"<p>{html.escape(text)}</p>" for text in block.texts)
    style = f"border-color: {edge}; background: {ground}"
    return f'<div class="verdict" style="{style}"><b>{html.escape(block.word)}</b>{texts}</div>'


@_element.register
def _facts(block: Facts) -> str:
    rows = (f"<dt>{html.escape(a)}</dt><dd>{html.escape(b)}</dd>" for a, b in block.rows)
    return f"<dl>{''.join(rows)}</dl>"


@_element.register
def _items(block: Items) -> str:
    return "<ul>" + "".join(f"<li>{html.escape(text)}</li>" for text in block.texts) + "</ul>"


@_element.register
def _signature(block: SignatureFields) -> str:
    fields = (f"<div>{html.escape(label)}, date</div>" for label in block.labels)
    return f'<div class="sign">{"".join(fields)}</div>'


@_element.register
def _table(block: Table) -> str:
    wide = [' class="wide"' if column.wide else "" for column in block.columns]
    groups = "".join(f'<th colspan="{n}">{html.escape(t)}</th>' for t, n in block.groups)
    head = f'<tr class="groups">{groups}</tr>' if groups else ""
    head += "<tr>" + "".join(
        f"<th{kind}>{html.escape(column.title)}</th>"
        for column, kind in zip(block.columns, wide, strict=True)
    ) + "</tr>"  # fmt: skip
    rows = []
    for row in block.rows:
        cells = "".join(map(_cell, block.columns, row))
        rows.append(f"<tr>{cells}</tr>")
    note = f'<p class="small">{html.escape(block.note)}</p>' if block.note else ""
    dense = ' class="dense"' if len(block.columns) > DENSE else ""
    table = f"<table{dense}><thead>{head}</thead><tbody>{''.join(rows)}</tbody></table>"
    return f'<div class="scroll">{table}</div>{note}'


def _cell(column: Column, cell: Cell) -> str:
    short = column.wide and len(cell.text) <= SHORT
    kinds = (cell.mark, "wide" * column.wide, "short" * short)
    return f'<td class="{" ".join(filter(None, kinds))}">{html.escape(cell.text)}</td>'


@_element.register
def _picture(block: Picture) -> str:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, block.height), layout="constrained")
    block.draw(figure)
    settle_layout(figure)
    drawn = figure_bytes(figure, "svg", dpi=200, metadata={"Date": None})
    data = base64.b64encode(drawn).decode("ascii")
    caption = html.escape(block.caption)
    return (
        f'<figure><img alt="{caption}" src="data:image/svg+xml;base64,{data}">'
        f"<figcaption>{caption}</figcaption></figure>"
    )
