"""Odd values, odd changes of sound texts and data, and what none of them may bring about."""

from __future__ import annotations

import contextlib
import decimal
import fractions
import math
import random
import re
import traceback
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tomli_w import dumps

from hexapod_pin.spec import read_toml

ESCAPE = "\x1b]0;owned\x07"
"""Sets the title of a terminal that it is printed on."""

NUMBERS = (
    0, 1, -1, 2, 0.5, -0.5, 1e-3, 1e-9, 1e-300, 1e9, -1e9, 1e18, 1e150, 1e308, -1e308, 2**70,
    math.nan, math.inf, -math.inf,
)  # fmt: skip

WORDS = (
    "", "x", "-", "--", "universe", "nan", "true", "[]", "{}", "\0", "a\0b", "</script>", "é" * 300,
    "x/" * 3000, "~unknown/x", "/", "/dev/null", "/dev/zero", "pipe.nc", ".", "..", "*", "0.01",
    ESCAPE, "\\u001b]0;owned\\u0007", "=HYPERLINK(1)", "\u202ex",
)  # fmt: skip
"""The escape is also written as TOML writes it."""

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


def odd_toml(text: str, rng: random.Random) -> str:
    """Return a text of TOML with changes, also values of other types."""
    with contextlib.suppress(TypeError, ValueError, AttributeError):  # what TOML has not
        return odd_text(text, rng) if rng.random() < 0.5 else dumps(odd_data(read_toml(text), rng))
    return odd_text(text, rng)


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
    if isinstance(data, dict) and data and rng.random() < 0.9:
        key = rng.choice(list(data))
        if rng.random() < 0.1:
            return {name: value for name, value in data.items() if name != key}
        return {**data, key: odd_data(data[key], rng)}
    if isinstance(data, list) and data and rng.random() < 0.8:
        k = rng.randrange(len(data))
        return [*data[:k], odd_data(data[k], rng), *data[k + 1 :]]
    return odd_value(rng)


# what no input may bring about ----------------------------------------------------------------

_NOT_FINITE = re.compile(r"(?<![\w.'-])[-+]?(?:nan|inf)(?![\w.'-])", re.IGNORECASE)
"""Between quotes it is a text: a name, or what was given."""

_GIVEN = re.compile(r"(?<![\w.-])[-+]?(?:nan|inf)(?![\w.-])", re.IGNORECASE)
"""The same as a number or a text."""

_WRONG_CALL = re.compile(
    r"missing \d+ required|unexpected keyword|takes .* positional|multiple values for|"
    r"missing a required|too many positional"
)
"""Python's own words where an argument is missing or there is no such keyword."""

_OURS = re.compile(r".*/(?:hexapod_pin/|tests/(?=fuzz/))")
"""Before the name of a module of the package, or of the campaign."""


class FaultFound(Exception):
    """What a door has found: something that no input may bring about.

    Attributes:
        slow: whether it only took too long, which may be the machine's fault.
    """

    def __init__(self, message: str, *, slow: bool = False) -> None:
        """Keep the rest beside the message."""
        self.slow = slow
        super().__init__(message)


def require_finite(text: str, *given: str) -> None:
    """Refuse a text with nan or inf in it, unless they were given."""
    if any(_GIVEN.search(one) or _is_read_as_not_finite(one) for one in given):
        return
    found = _NOT_FINITE.search(text)
    if found:
        near = text[max(0, found.start() - 40) : found.end() + 20]
        raise FaultFound(f"shows {found[0]!r}: ...{near!r}...")


def _is_read_as_not_finite(word: str) -> bool:
    """Tell whether a word is a number that is not finite, such as 1e999: a refusal quotes it."""
    try:
        return not math.isfinite(float(word))
    except ValueError:
        return False


def is_wrong_call(error: Exception) -> bool:
    return isinstance(error, TypeError) and bool(_WRONG_CALL.search(str(error)))


def described(error: Exception) -> str:
    frames = [f for f in traceback.extract_tb(error.__traceback__) if _OURS.match(f.filename)]
    place = f"{_OURS.sub('', frames[-1].filename)}:{frames[-1].lineno}"
    first = (str(error).splitlines() or [""])[0]
    return f"{type(error).__name__}: {first[:100]} at {place}"
