"""What a controller remembers, as JSON can hold it: numbers, arrays, mappings, sequences."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from hexapod_pin.errors import StateError

ARRAY, TUPLE = "__array__", "__tuple__"

KINDS = tuple(np.dtype(kind).str for kind in ("f8", "f4", "f2", "i8", "i4", "i2", "i1", "u8", "u4",
                                              "u2", "u1", "?"))  # fmt: skip
"""Types of numbers that an array may have."""


def to_plain(value: Any, where: str = "state") -> Any:
    """Return `value` as JSON-able data; every digit is kept.

    Raises:
        StateError: it holds something else; names where.
    """
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, np.ndarray | np.generic):
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            raise StateError(f"{where}: an array of {array.dtype} cannot be kept in a checkpoint.")
        return {ARRAY: array.dtype.str, "shape": list(array.shape), "data": array.ravel().tolist()}
    if isinstance(value, Mapping):
        return {str(key): to_plain(item, f"{where}.{key}") for key, item in value.items()}
    if isinstance(value, list | tuple):
        items = [to_plain(item, f"{where}[{k}]") for k, item in enumerate(value)]
        return items if isinstance(value, list) else {TUPLE: items}
    raise StateError(
        f"{where}: {type(value).__name__} cannot be kept in a checkpoint; a controller's state is "
        "made of numbers, arrays, mappings, lists and tuples."
    )


def odd_part(value: Any, where: str = "state") -> tuple[str, str] | None:
    """Return the place and the type of what `to_plain` would refuse; None where it takes all."""
    if value is None or isinstance(value, str | bool | int | float):
        return None
    if isinstance(value, np.ndarray | np.generic):
        return None if value.dtype.kind in "fiub" else (where, f"array of {value.dtype}")
    if isinstance(value, Mapping):
        parts: Iterable[tuple[str, Any]] = ((f"{where}.{key}", x) for key, x in value.items())
    elif isinstance(value, list | tuple):
        parts = ((f"{where}[{k}]", item) for k, item in enumerate(value))
    else:
        return where, type(value).__name__
    return next((odd for place, item in parts if (odd := odd_part(item, place))), None)


def from_plain(value: Any, where: str = "state") -> Any:
    """Return what `to_plain` was given.

    Raises:
        StateError: `to_plain` has not made it; names where.
    """
    if isinstance(value, list):
        return [from_plain(item, f"{where}[{k}]") for k, item in enumerate(value)]
    if not isinstance(value, Mapping):
        return value
    if ARRAY in value:
        return _array(value, where)
    if TUPLE in value:
        if not isinstance(value[TUPLE], list):
            raise StateError(f"{where}: {TUPLE} must be a list.")
        return tuple(from_plain(item, f"{where}[{k}]") for k, item in enumerate(value[TUPLE]))
    return {key: from_plain(item, f"{where}.{key}") for key, item in value.items()}


def _array(value: Mapping[str, Any], where: str) -> np.ndarray[Any, Any]:
    kind, shape, data = value[ARRAY], value.get("shape"), value.get("data")
    if not isinstance(kind, str) or kind not in KINDS:
        raise StateError(f"{where}: {ARRAY} = {kind!r}: must be one of {', '.join(KINDS)}.")
    if not isinstance(shape, list) or not all(type(n) is int and n >= 0 for n in shape):
        raise StateError(f"{where}.shape = {shape!r}: must be whole numbers.")
    if not isinstance(data, list) or math.prod(shape) != len(data):
        raise StateError(f"{where}: must have as much data as its shape says.")
    if not all(isinstance(item, int | float) for item in data):
        raise StateError(f"{where}.data: must be numbers.")
    try:
        return np.array(data, dtype=np.dtype(kind)).reshape(shape)
    except (OverflowError, ValueError) as error:
        raise StateError(f"{where}.data: must be numbers of {kind} ({error}).") from error
