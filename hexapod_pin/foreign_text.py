"""Text that comes from outside (names in files, arguments), before a terminal or table gets it."""

from __future__ import annotations

import re

_CONTROL = (
    r"\x00-\x08\x0b-\x1f\x7f-\x9f"  # C0 but tab and newline, DEL, C1
    r"\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # change the direction of what follows
    r"\u2028\u2029"  # separators of lines and paragraphs
    r"\ud800-\udfff"  # halves of a pair: a byte of a file's name that is no UTF-8
)

_NOT_PRINTED = re.compile(f"[{_CONTROL}]")


def visible(text: str) -> str:
    r"""Return a text with an escape such as `\x1b` for each character that a terminal acts on.

    Newlines and tabs stay. Half a pair of surrogates, which cannot be encoded, is written as
    `\udc80` and the like.
    """
    return _NOT_PRINTED.sub(_escape, text)


def _escape(found: re.Match[str]) -> str:
    number = ord(found.group())
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}"
