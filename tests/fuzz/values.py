"""Odd values, and odd changes of sound texts and data."""

from __future__ import annotations

import decimal
import fractions
import math
import random
import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

ESCAPE = "\x1b]0;owned\x07"
"""Sets the title of a terminal that it is printed on."""

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
    1j, range(3), frozenset((1,)), decimal.Decimal("NaN"), fractions.Fraction(1, 3), 10**400,
    "\ud800", f"{ESCAPE}x", "=1+1", Path("x"), Path("a\0b"), ..., bytearray(b"x"),
    np.float64("nan"), np.int8(-1), np.zeros(0), np.zeros((3, 3)), np.array("x"),
    np.array(math.nan), np.array([None]), np.array([True]), np.array(["2000-01-01"], "M8[D]"),
    np.zeros(2, complex),
)  # fmt: skip


def odd_value(rng: random.Random) -> Any:
    """Return a number or something else."""
    if rng.random() < 0.5:
        return rng.choice(NUMBERS)
    if rng.random() < 0.3:
        return [rng.choice(NUMBERS) for _ in range(rng.randrange(5))]
    return rng.choice(OTHERS)


def odd_text(text: str, rng: random.Random) -> str:
    """Return a text with a few numbers, words or stretches of it changed."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        text = rng.choice((_other_number, _other_number, _other_word, _cut, _twice))(text, rng)
    return text


def _other(pattern: str, values: tuple[Any, ...], text: str, rng: random.Random) -> str:
    found = list(re.finditer(pattern, text))
    if not found:
        return text
    place = rng.choice(found)
    return text[: place.start()] + str(rng.choice(values)) + text[place.end() :]


_other_number = partial(_other, r"-?\d+\.?\d*(?:e-?\d+)?", NUMBERS)
_other_word = partial(_other, "[A-Za-z_]{2,}", WORDS)


def _cut(text: str, rng: random.Random) -> str:
    begin = rng.randrange(len(text) + 1)
    return text[:begin] + text[begin + rng.choice((1, 3, 30, len(text))) :]


def _twice(text: str, rng: random.Random) -> str:
    begin = rng.randrange(len(text) + 1)
    end = begin + rng.choice((1, 10, 100))
    return text[:end] + text[begin:end] + text[end:]


def odd_data(data: Any, rng: random.Random) -> Any:
    """Return plain data with one place in it changed."""
    if isinstance(data, dict) and data and rng.random() < 0.9:
        key = rng.choice(list(data))
        if rng.random() < 0.1:
            return {name: value for name, value in data.items() if name != key}
        return {**data, key: odd_data(data[key], rng)}
    if isinstance(data, list) and data and rng.random() < 0.8:
        k = rng.randrange(len(data))
        return [*data[:k], odd_data(data[k], rng), *data[k + 1 :]]
    return odd_value(rng)
