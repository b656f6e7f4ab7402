"""How tests check a refusal: by the type and the fields of the error, not by its sentence.

`refused(ParameterError, "Servo.kp", 0.0, allowed=(1e-6,))` reads: the block raises a ParameterError
whose `name` is "Servo.kp", whose `value` is 0.0, and whose allowed range states the number 1e-6.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

ANY = object()
"""A value that the test leaves open."""

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])")


@contextmanager
def refused(
    kind: type[BaseException] | tuple[type[BaseException], ...],
    /,
    name: str | None = None,
    value: Any = ANY,
    *,
    allowed: tuple[float, ...] = (),
    about: tuple[str, ...] = (),
    **fields: Any,
) -> Iterator[pytest.ExceptionInfo[Any]]:
    """Expect the block to raise an error of this type with these fields.

    Args:
        kind: type of the error, or several of them.
        name: its field `name`, exactly: the dotted name of a parameter, a package, a resource.
        value: its field `value`; two NaN are equal, and so are arrays of equal numbers.
        allowed: numbers that its field `allowed` must state.
        about: what its message must contain; a number must stand there as a word of its own.
        fields: any other fields, by name: `leg="lf"`, `quantity="stroke"`, `limit=...`.
    """
    with pytest.raises(kind) as caught:
        yield caught
    error = caught.value
    expected = {**({} if name is None else {"name": name}), **fields}
    expected |= {} if value is ANY else {"value": value}
    for field, wanted in expected.items():
        assert hasattr(error, field), f"{type(error).__name__} has no {field}: {error}"
        found = getattr(error, field)
        assert _equal(found, wanted), f"{field} is {found!r}, not {wanted!r}: {error}"
    if allowed:
        numbers = [float(one) for one in NUMBER.findall(str(getattr(error, "allowed", "")))]
        for number in allowed:
            assert number in numbers, f"{number} is none of the numbers that are allowed: {error}"
    for word in about:
        message = str(error)
        place = NUMBER.findall(message) if NUMBER.fullmatch(word) else message
        assert word in place, f"{word!r} is not in the message: {error}"


def _equal(found: Any, wanted: Any) -> bool:
    """Return whether two values are the same; NaN equals NaN, a list a tuple or an array."""
    if found is wanted:
        return True
    if isinstance(found, (list, tuple)) and isinstance(wanted, (list, tuple)):
        pairs = zip(found, wanted, strict=False)
        return len(found) == len(wanted) and all(_equal(one, other) for one, other in pairs)
    if isinstance(found, np.ndarray) or isinstance(wanted, np.ndarray):
        return np.array_equal(found, wanted)
    if isinstance(found, float) and isinstance(wanted, float) and found != found:
        return wanted != wanted
    return bool(found == wanted)
