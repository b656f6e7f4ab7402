"""Pages of A4 that fill from top to bottom: texts, lines and figures at places in points."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from hexapod_pin.foreign_text import visible
from hexapod_pin.view.figure_file import plain_texts, settle_layout
from hexapod_pin.view.report_text import LEADING, wrapped

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure, FigureBase

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
