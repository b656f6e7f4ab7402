"""Arrays as the package keeps them: double precision, read-only where they are stored."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
"""An array of doubles; shape, unit and frame stand where it is used."""


def read_only(values: ArrayLike) -> Array:
    """Return an own, contiguous, write-protected copy in double precision."""
    array = np.array(values, dtype=np.float64, order="C")
    array.flags.writeable = False
    return array


def digest(text: str) -> str:
    """Return the SHA-256 of a text, in hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()
