"""What a controller remembers, as JSON can hold it: numbers, arrays, mappings, sequences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hexapod_pin.errors import StateError

ARRAY, TUPLE = "__array__", "__tuple__"


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


def from_plain(value: Any) -> Any:
    """Return what `to_plain` was given."""
    if isinstance(value, list):
        return [from_plain(item) for item in value]
    if not isinstance(value, Mapping):
        return value
    if ARRAY in value:
        return np.array(value["data"], dtype=np.dtype(value[ARRAY])).reshape(value["shape"])
    if TUPLE in value:
        return tuple(from_plain(item) for item in value[TUPLE])
    return {key: from_plain(item) for key, item in value.items()}
