"""Arrays as the package keeps them: double precision, read-only where they are stored."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
"""An array of doubles; shape, unit and frame stand where it is used."""


def read_only(values: ArrayLike) -> Array:
    """Return the values as a contiguous, write-protected array in double precision.

    A copy, unless they are such an array already: that one is shared.
    """
    if _is_stored(values):
        return values  # type: ignore[return-value]  # checked
    array = np.array(values, dtype=np.float64, order="C")
    array.flags.writeable = False
    return array


def protect(record: object) -> None:
    """Write-protect the arrays that are attributes of a record."""
    for value in vars(record).values():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False


def same_bits(first: object, second: object) -> bool:
    """Tell whether two values are the same; numbers, and those in arrays, to the bit."""
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        if first.shape != second.shape or first.dtype != second.dtype:
            return False
        if first.dtype == object:
            return bool((first == second).all())
        return first.tobytes() == second.tobytes()
    if isinstance(first, float) and isinstance(second, float):
        return np.float64(first).tobytes() == np.float64(second).tobytes()
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        return first.keys() == second.keys() and all(
            same_bits(value, second[key]) for key, value in first.items()
        )
    return bool(first == second)


def _is_stored(values: ArrayLike) -> bool:
    """Tell whether `values` is a contiguous array of doubles that nothing can write to."""
    if type(values) is not np.ndarray or values.dtype != np.float64:
        return False
    if not values.flags.c_contiguous:
        return False
    array: object = values
    while isinstance(array, np.ndarray):
        if array.flags.writeable:
            return False
        array = array.base
    return True


def digest(text: str) -> str:
    """Return the SHA-256 of a text, in hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()
