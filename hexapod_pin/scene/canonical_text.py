"""Plain data as one text in which equal numbers are spelt alike, to be hashed."""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import Any

EXACT_INTEGERS = 2**53
"""Up to here a double holds every whole number."""

KEPT_TEXTS = 128
"""How many parts are remembered with their text."""


def canonical_text(value: Any) -> str:
    """Return plain data as JSON with sorted keys, equal numbers spelt alike to the bit."""
    return json.dumps(_canonical(value), sort_keys=True)


def joined(parts: Mapping[str, str]) -> str:
    """Return the JSON of a table from the JSON of its values."""
    return "{" + ", ".join(f"{json.dumps(key)}: {parts[key]}" for key in sorted(parts)) + "}"


def _canonical(value: Any) -> Any:
    """Return data in which equal numbers are spelt alike, to the bit."""
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, str) or value is None or isinstance(value, bool):
        return value
    if isinstance(value, dict):
        return {str(key): _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    if isinstance(value, int):
        return str(value) if abs(value) > EXACT_INTEGERS else float(value).hex()
    return _canonical(dict(value)) if isinstance(value, Mapping) else value


class _Texts:
    """Texts of the parts used last, by identity: a stored part prevents reuse of its id."""

    def __init__(self) -> None:
        self.texts: OrderedDict[int, tuple[object, str]] = OrderedDict()

    def of(self, part: Any, write: Callable[[Any], str]) -> str:
        """Return the text of a part that never changes; it is written once."""
        found = self.texts.get(id(part))
        if found is not None and found[0] is part:
            return found[1]
        text = write(part)
        self.texts[id(part)] = (part, text)
        while len(self.texts) > KEPT_TEXTS:
            self.texts.pop(next(iter(self.texts)), None)
        return text


TEXTS = _Texts()
"""Texts of parts that many cases share: contact, servos, stops, terrain, walk."""
