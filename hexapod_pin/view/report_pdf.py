"""The PDF file of a report, typeset by fpdf2: texts, tables and figures on pages of A4."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from datetime import datetime, timezone
from itertools import zip_longest
from pathlib import Path
from textwrap import wrap
from typing import Any

from fpdf import FPDF
from fpdf.fonts import FontFace, TTFFont
from matplotlib import get_data_path

from hexapod_pin.foreign_text import visible

LEADING = 1.28
"""Distance of lines over the size of the type [-]."""

PAD = 3.0
"""Room on either side of a cell [pt]."""

SMALLEST = 4.5
"""Size of type of tables that do not fit the page's width in a larger one [pt]."""

SHORT = 14.0
"""Width that a column of texts has where its texts are as wide, over the size of type [-]."""

WITH_TITLE = 110.0
"""Room for the title of a section and for the beginning of what follows [pt]."""

BODY, SMALL = 8.5, 7.0
"""Sizes of type [pt]."""

INK, GREY, LIGHT = "#1a1a1a", "#333333", "#555555"
COLORS = {"bad": "#9c1f17", "good": "#2e6b34", "": INK}
"""Of the cells of a table, by their marks."""

Columns = Sequence[tuple[str, bool]]
Rows = Sequence[Sequence[tuple[str, str]]]

FONT = "DejaVu Sans"

COUNT = "‡‡"
"""Stands for it until the file is complete."""

EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
"""Date of creation in every file, which fpdf2 cannot leave out: the same report, the same bytes."""


class Paper(FPDF):
    """Pages that fill from top to bottom; all lengths are in points.

    Fonts are those of matplotlib; a character that they lack is printed as a box.
    """

    def __init__(self, title: str) -> None:
        """Begin the first page; the title stands at the foot of each."""
        super().__init__(unit="pt", format="A4")
        self.set_margins(34.8, 36.0)
        self.set_auto_page_break(True, 44.0)
        self.c_margin = 0.0
        fonts = Path(get_data_path()) / "fonts" / "ttf"
        self.add_font(FONT, "", fonts / "DejaVuSans.ttf")
        self.add_font(FONT, "B", fonts / "DejaVuSans-Bold.ttf")
        regular = self.fonts[FONT.lower()]
        self.letters = regular.cmap if isinstance(regular, TTFFont) else {}
        self.set_title(self.plain(title))
        self.set_creation_date(EPOCH)
        self.alias_nb_pages(COUNT)
        self.add_page()
        self._style(SMALL)
        lines: Any = self.multi_cell(400.0, text=self.plain(title), dry_run=True, output="LINES")
        self.footline: str = lines[0] if lines else ""

    def close(self) -> None:
        """Close the files of the fonts, which fpdf2 leaves open."""
        for font in self.fonts.values():
            if isinstance(font, TTFFont):
                font.ttfont.close()

    def file_id(self) -> None:
        """Return no number of the file: it would be of its time."""

    def footer(self) -> None:
        """Print title and number of the page at its foot."""
        self.set_y(-32.0)
        self._style(SMALL, False, LIGHT)
        self.cell(400.0, 10.0, self.footline)
        self.cell(0.0, 10.0, f"page {self.page_no()} of {COUNT}", align="R")

    def plain(self, text: str) -> str:
        """Return text in one line, with a box for what the font lacks."""
        line = " ".join(visible(text).split())
        return "".join(letter if ord(letter) in self.letters else "\N{WHITE SQUARE}"
                       for letter in line)  # fmt: skip

    def room(self, height: float) -> None:
        """Begin a new page unless the last has room for a height."""
        if self.will_page_break(height):
            self.add_page()

    def _style(self, size: float, bold: bool = False, color: str = INK) -> None:
        self.set_font(FONT, "B" if bold else "", size)
        self.set_text_color(color)

    def title_line(self, text: str) -> None:
        """Print the title of the report."""
        self._write(text, 17.0, bold=True)
        self.ln(6.0)

    def paragraph(self, text: str, *, small: bool = False) -> None:
        """Print text in as many lines as it needs."""
        self._write(text, *((SMALL, False, GREY) if small else (BODY, False, INK)))
        self.ln(4.0)

    def _write(
        self, text: str, size: float, bold: bool = False, color: str = INK, **options: Any
    ) -> None:
        self._style(size, bold, color)
        self.multi_cell(0.0, LEADING * size, self.plain(text), align="L", new_x="LMARGIN",
                        new_y="NEXT", **options)  # fmt: skip

    def heading(self, text: str) -> None:
        """Print the title of a section, which stays with what follows."""
        self.room(WITH_TITLE)
        self.ln(9.0)
        self.start_section(self.plain(text))
        self._line(0.8, INK)
        self._write(text, 11.0, bold=True, border="B", padding=(0.0, 0.0, 2.0))
        self.ln(6.0)

    def _line(self, width: float, color: str) -> None:
        self.set_line_width(width)
        self.set_draw_color(color)

    def box(self, word: str, texts: Sequence[str], edge: str, fill: str) -> None:
        """Print a word and sentences on a coloured ground with an edge to the left."""
        self.room(WITH_TITLE)
        self._line(6.0, edge)
        self.set_fill_color(fill)
        look: dict[str, Any] = {"border": "L", "fill": True}
        self._write(word, 11.0, bold=True, padding=(6.0, 8.0, 2.0, 12.0), **look)
        for text in texts:
            self._write(text, BODY, padding=(2.0, 8.0, 4.0, 12.0), **look)
        self.set_fill_color(255)
        self.ln(6.0)

    def pairs(self, rows: Sequence[tuple[str, str]], left: float, *, small: bool = False) -> None:
        """Print labels of a width, and texts beside them."""
        size = SMALL if small else BODY
        look: dict[str, Any] = {
            "borders_layout": "NONE", "first_row_as_headings": False, "text_align": "L",
            "v_align": "T", "padding": (0.0, 4.0, 1.5, 0.0), "line_height": LEADING * size,
        }  # fmt: skip
        widths = (left, self.epw - left)
        self._style(size)
        label = FontFace(color=LIGHT)
        with self.table(col_widths=widths, **look) as table:
            for row in rows:
                for name, text in self._parts(row, widths, size):
                    cells = table.row()
                    cells.cell(name, style=label)
                    cells.cell(text)
        self.ln(4.0)

    def _parts(
        self, row: Sequence[str], widths: Sequence[float], size: float
    ) -> Iterator[tuple[str, ...]]:
        """Yield a row as several, each lower than a page."""
        pieces = [
            wrap(self.plain(text), max(int(40.0 * width / size), 40)) or [""]
            for text, width in zip(row, widths, strict=True)
        ]
        yield from zip_longest(*pieces, fillvalue="")

    def signatures(self, labels: Sequence[str]) -> None:
        """Print lines to sign on, side by side."""
        self.room(60.0)
        self.ln(40.0)
        self._style(SMALL)
        self._line(0.6, INK)
        width = (self.epw - 20.0 * (len(labels) - 1)) / len(labels)
        for label in labels:
            self.cell(width, 14.0, self.plain(label), border="T")
            self.cell(20.0, 14.0, "")
        self.ln(20.0)

    def picture(self, png: io.BytesIO, height: float, caption: str) -> None:
        """Print a figure over the whole width, or the whole height, with its caption below."""
        from PIL import Image

        below = 8.0 * LEADING * SMALL
        height = min(height, self.eph - below)
        self.room(height + below)
        with Image.open(png) as drawn:
            self.image(drawn.convert("RGB"), w=self.epw, h=height, keep_aspect_ratio=True,
                       alt_text=self.plain(caption))  # fmt: skip
        self.ln(2.0)
        self.paragraph(caption, small=True)
        self.ln(4.0)

    def grid(self, columns: Columns, rows: Rows, groups: Sequence[tuple[str, int]] = ()) -> None:
        """Print a table over the whole width; its titles stand on each page.

        Args:
            columns: titles, and whether texts of the column may be broken into lines.
            rows: texts of cells, and their marks: one of `COLORS`.
            groups: titles above the columns, with how many columns each spans.
        """
        size, widths = self.fitted(columns, rows)
        self._style(size)
        self._line(0.3, "#bbbbbb")
        sides = ["L" if wide else "R" for _, wide in columns]
        with self.table(
            col_widths=widths, text_align=sides, v_align="T", line_height=LEADING * size,
            borders_layout="HORIZONTAL_LINES", padding=(1.0, PAD, 2.0, PAD),
            num_heading_rows=2 if groups else 1,
        ) as printed:  # fmt: skip
            if groups:
                above = printed.row()
                for title, count in groups:
                    above.cell(self.plain(title), colspan=count, align="C")
            printed.row([self.plain(title) for title, _ in columns], v_align="B")
            for row in rows:
                for texts in self._parts([text for text, _ in row], widths, size):
                    cells = printed.row()
                    for text, (_, mark) in zip(texts, row, strict=True):
                        bold = "BOLD" if mark == "bad" else ""
                        cells.cell(text, style=FontFace(emphasis=bold, color=COLORS[mark]))
        self.ln(4.0)

    def fitted(self, columns: Columns, rows: Rows) -> tuple[float, list[float]]:
        """Return the size of type and the widths of columns that fill the page's width."""
        self._style(1.0, bold=True)
        least, more = [], []  # over the size: what must not be broken, and what else is there
        for k, (title, wide) in enumerate(columns):
            texts = [self.plain(row[k][0]) for row in rows]
            words = [word for text in texts for word in text.split()] if wide else texts
            word, whole = (
                max(1.0, *map(self.get_string_width, parts))
                for parts in ((*words, *title.split()), (*texts, title))
            )
            least.append(min(word, SHORT) if wide else word)
            more.append(whole - least[-1])
        across = self.epw - 2.0 * PAD * len(least)
        size = max(min(SMALL, across / sum(least)), SMALLEST)
        spare = max(across / size - sum(least), 0.0)
        widths = list(least)
        for left, k in enumerate(sorted(range(len(least)), key=more.__getitem__)):
            given = min(more[k], spare / (len(least) - left))
            widths[k], spare = widths[k] + given, spare - given
        return size, [across * width / sum(widths) + 2.0 * PAD for width in widths]
