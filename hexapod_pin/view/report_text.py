"""Texts on a page of paper: their width, and lines that fit."""

from __future__ import annotations

from functools import cache

LEADING = 1.28
"""Distance of lines over the size of the type [-]."""


@cache
def text_width(text: str, size: float, bold: bool = False) -> float:
    """Return the width of a text in the report's type [pt].

    Args:
        text: one line.
        size: of the type [pt].
        bold: whether it is bold.
    """
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(family="DejaVu Sans", size=size, weight="bold" if bold else "normal")
    return float(text_to_path.get_text_width_height_descent(text, font, ismath=False)[0])


def wrapped(text: str, width: float, size: float, bold: bool = False) -> list[str]:
    """Return a text in lines of at most this width [pt]; longer words are broken."""
    lines = [""]
    for word in text.split():
        for piece in _pieces(word, width, size, bold):
            longer = f"{lines[-1]} {piece}".strip()
            if lines[-1] and text_width(longer, size, bold) > width:
                lines.append(piece)
            else:
                lines[-1] = longer
    return lines


def _pieces(word: str, width: float, size: float, bold: bool) -> list[str]:
    """Return a word, or the parts of it that fit into a line."""
    if text_width(word, size, bold) <= width:
        return [word]
    pieces = [""]
    for letter in word:
        if pieces[-1] and text_width(pieces[-1] + letter, size, bold) > width:
            pieces.append(letter)
        else:
            pieces[-1] += letter
    return pieces
