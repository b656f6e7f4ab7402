"""A report as a PDF of A4 pages, drawn by matplotlib: what the HTML page holds, on paper."""

from __future__ import annotations

from functools import singledispatch

from hexapod_pin.view.report_blocks import (
    LEVELS,
    Block,
    Blocks,
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
from hexapod_pin.view.report_pdf import ACROSS, INCH, LEADING, LEFT, Sheets, draw_table, wrapped

BODY, SMALL = 8.5, 7.0
"""Sizes of type [pt]."""

WITH_TABLE = 110.0
"""Room for what introduces a table, and for the table's first rows [pt]."""

LABELS = 120.0
"""Width of the labels of facts [pt]."""

GREY = "#555555"


def pdf_pages(blocks: Blocks) -> bytes:
    """Return a report as pages.

    Raises:
        MissingPackageError: matplotlib is not installed.
    """
    sheets = Sheets()
    for block, after in zip(blocks, (*blocks[1:], None), strict=True):
        if isinstance(block, Heading):
            sheets.room(30.0 + (after.height * INCH if isinstance(after, Picture) else 60.0))
        elif isinstance(after, Table):
            sheets.room(WITH_TABLE)
        _draw(block, sheets)
    return sheets.pdf(next((b.text for b in blocks if isinstance(b, Title)), "Report"))


@singledispatch
def _draw(block: Block, sheets: Sheets) -> None:
    raise TypeError(type(block).__name__)


@_draw.register
def _title(block: Title, sheets: Sheets) -> None:
    sheets.paragraph(block.text, 17.0, bold=True)
    sheets.y += 6.0


@_draw.register
def _heading(block: Heading, sheets: Sheets) -> None:
    sheets.y += 9.0
    sheets.paragraph(block.text, 11.0, bold=True)
    sheets.line(sheets.y + 1.5, LEFT, LEFT + ACROSS, 0.8)
    sheets.y += 6.0


@_draw.register
def _paragraph(block: Paragraph, sheets: Sheets) -> None:
    size = SMALL if block.small else BODY
    sheets.room(3.0 * LEADING * size)
    sheets.paragraph(block.text, size, color="#333333" if block.small else "#1a1a1a")
    sheets.y += 4.0


@_draw.register
def _verdict(block: Verdict, sheets: Sheets) -> None:
    inner = ACROSS - 20.0
    lines = sum(len(wrapped(text, inner, BODY)) for text in block.texts)
    height = 26.0 + lines * LEADING * BODY + 4.0 * len(block.texts) + 4.0
    sheets.room(height)
    top = sheets.y
    sheets.frame(top, top + height, *LEVELS[block.level])
    sheets.y += 6.0
    sheets.paragraph(block.word, 11.0, left=LEFT + 10.0, width=inner, bold=True)
    for text in block.texts:
        sheets.y += 4.0
        sheets.paragraph(text, BODY, left=LEFT + 10.0, width=inner)
    sheets.y = top + height + 6.0


@_draw.register
def _facts(block: Facts, sheets: Sheets) -> None:
    for label, text in block.rows:
        names = wrapped(label, LABELS - 8.0, BODY)
        texts = wrapped(text, ACROSS - LABELS, BODY)
        for k in range(max(len(names), len(texts))):
            sheets.room(LEADING * BODY)
            sheets.y += LEADING * BODY
            base = sheets.y - 0.28 * BODY
            if k < len(names):
                sheets.write(LEFT, base, names[k], BODY, color=GREY)
            if k < len(texts):
                sheets.write(LEFT + LABELS, base, texts[k], BODY)
        sheets.y += 1.5
    sheets.y += 5.0


@_draw.register
def _items(block: Items, sheets: Sheets) -> None:
    for text in block.texts:
        sheets.room(LEADING * SMALL)
        sheets.write(LEFT + 4.0, sheets.y + SMALL, "•", SMALL)
        sheets.paragraph(text, SMALL, left=LEFT + 13.0, width=ACROSS - 13.0, color="#333333")
        sheets.y += 1.5
    sheets.y += 4.0


@_draw.register
def _signature(block: SignatureFields, sheets: Sheets) -> None:
    sheets.room(60.0)
    sheets.y += 40.0
    width = (ACROSS - 20.0 * (len(block.labels) - 1)) / len(block.labels)
    for k, label in enumerate(block.labels):
        left = LEFT + k * (width + 20.0)
        sheets.line(sheets.y, left, left + width, 0.6)
        sheets.write(left, sheets.y + 10.0, f"{label}, date", SMALL)
    sheets.y += 14.0


@_draw.register
def _table(block: Table, sheets: Sheets) -> None:
    draw_table(sheets, block)
    if block.note:
        sheets.paragraph(block.note, SMALL, color="#333333")
    sheets.y += 6.0


@_draw.register
def _picture(block: Picture, sheets: Sheets) -> None:
    lines = len(wrapped(block.caption, ACROSS, SMALL))
    sheets.room(block.height * INCH + lines * LEADING * SMALL + 8.0)
    sheets.figure(block.height * INCH, block.draw)
    sheets.y += 2.0
    sheets.paragraph(block.caption, SMALL, color="#333333")
    sheets.y += 8.0
