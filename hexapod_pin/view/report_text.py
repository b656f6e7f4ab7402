"""Texts on a page of paper: their width, and lines that fit."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from hexapod_pin.foreign_text import visible

if TYPE_CHECKING:
    from matplotlib.ft2font import FT2Font

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
