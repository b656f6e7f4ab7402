"""Odd values, and odd changes of sound texts and data."""

from __future__ import annotations

import math
import random
import re
from typing import Any

NUMBERS = (
    0, 1, -1, 2, 0.5, -0.5, 1e-3, 1e-9, 1e-300, 1e9, -1e9, 1e18, 1e150, 1e308, -1e308, 2**70,
    math.nan, math.inf, -math.inf,
)  # fmt: skip

WORDS = (
    "", "x", "universe", "nan", "true", "[]", "{}", "\0", "</script>", "é", "é" * 300, "~unknown/x",
)  # fmt: skip

OTHERS: tuple[Any, ...] = (
    None, True, False, "", "x", "1", "nan", "a\0b", "é" * 50, "é" * 300, "~unknown/x", ".", b"x",
    [], {}, (), [1], ["x"], [math.nan], [[1, 2], [3]], {"a": 1}, object(), int, lambda *_: None,
)  # fmt: skip


def odd_value(dice: random.Random) -> Any:
    """Return a number or something else."""
    if dice.random() < 0.5:
        return dice.choice(NUMBERS)
    if dice.random() < 0.3:
        return [dice.choice(NUMBERS) for _ in range(dice.randrange(5))]
    return dice.choice(OTHERS)


def odd_text(text: str, dice: random.Random) -> str:
    """Return a text with a few numbers, words or stretches of it changed."""
    for _ in range(dice.choice((1, 1, 1, 2, 4))):
        text = dice.choice((_other_number, _other_number, _other_word, _cut, _twice))(text, dice)
    return text


def _other_number(text: str, dice: random.Random) -> str:
    found = list(re.finditer(r"-?\d+\.?\d*(?:e-?\d+)?", text))
    if not found:
        return text
    place = dice.choice(found)
    return text[: place.start()] + str(dice.choice(NUMBERS)) + text[place.end() :]


def _other_word(text: str, dice: random.Random) -> str:
    found = list(re.finditer(r"[A-Za-z_]{2,}", text))
    if not found:
        return text
    place = dice.choice(found)
    return text[: place.start()] + dice.choice(WORDS) + text[place.end() :]


def _cut(text: str, dice: random.Random) -> str:
    begin = dice.randrange(len(text) + 1)
    return text[:begin] + text[begin + dice.choice((1, 3, 30, len(text))) :]


def _twice(text: str, dice: random.Random) -> str:
    begin = dice.randrange(len(text) + 1)
    end = begin + dice.choice((1, 10, 100))
    return text[:end] + text[begin:end] + text[end:]


def odd_data(data: Any, dice: random.Random) -> Any:
    """Return plain data with one place in it changed."""
    if isinstance(data, dict) and data and dice.random() < 0.9:
        key = dice.choice(list(data))
        if dice.random() < 0.1:
            return {name: value for name, value in data.items() if name != key}
        return {**data, key: odd_data(data[key], dice)}
    if isinstance(data, list) and data and dice.random() < 0.8:
        k = dice.randrange(len(data))
        return [*data[:k], odd_data(data[k], dice), *data[k + 1 :]]
    return odd_value(dice)
