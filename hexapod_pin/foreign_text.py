"""Text from outside (names in files, arguments), before a terminal or a spreadsheet gets it."""

from __future__ import annotations

import re

_CONTROL = (
    r"\x00-\x08\x0b-\x1f\x7f-\x9f"  # C0 but tab and newline, DEL, C1
    r"\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # change the direction of what follows
    r"\u2028\u2029"  # separators of lines and paragraphs
    r"\ud800-\udfff"  # halves of a pair: a byte of a file's name that is no UTF-8
)

_NOT_PRINTED = re.compile(f"[{_CONTROL}]")

_FORMULA = re.compile(r"'*[=+\-@\t\r]")


def visible(text: str) -> str:
    r"""Return a text with an escape such as `\x1b` for each character that a terminal acts on.

    Newlines and tabs stay. Half a pair of surrogates, which cannot be encoded, is written as
    `\udc80` and the like.
    """
    return _NOT_PRINTED.sub(_escape, text)


def has_control(text: str) -> bool:
    """Tell whether a text has a character that a terminal acts on, other than newline and tab."""
    return _NOT_PRINTED.search(text) is not None


def encoded(text: str) -> bytes:
    r"""Return the UTF-8 of a page or table; half a pair of surrogates stands in it as `\ud800`."""
    return text.encode("utf-8", "backslashreplace")


def csv_cell(text: str) -> str:
    """Return the cell of a text: with an apostrophe first where it begins like a formula.

    A spreadsheet takes what begins with =, +, -, @, a tab or a carriage return for a formula, also
    between quotes. Numbers are no texts: they are written as they are.
    """
    return f"'{text}" if _FORMULA.match(text) else text


def text_of_cell(cell: str) -> str:
    """Return the text whose cell `csv_cell` returns."""
    return cell[1:] if cell[:1] == "'" and _FORMULA.match(cell) else cell


def _escape(found: re.Match[str]) -> str:
    number = ord(found.group())
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}"
