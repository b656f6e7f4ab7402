"""Errors of a summary's numbers, from the numbers of a companion of another resolution."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hexapod_pin.results.summary_layout import LAYOUT

WITHOUT_ERROR = ("way", "first_yaw")
"""Numbers that others are made of."""


def number_errors(
    numbers: Mapping[str, Any], companion: Mapping[str, Any], share: float
) -> dict[str, Any]:
    """Return how far each number of a summary may be off, in its unit.

    Of numbers with a sign, that of their size. Times of peaks have none: of two peaks of the same
    height either may be found.

    Args:
        numbers: those of `Summary.data`.
        companion: those of a companion.
        share: of the difference that the error is at most [-].
    """
    found: dict[str, Any] = {}
    for name in LAYOUT:
        value, other = numbers.get(name), companion.get(name)
        if name.endswith("_time") and name != "loaded_time" or name in WITHOUT_ERROR:
            continue
        if value is None or other is None or np.shape(value) != np.shape(other):
            continue
        change = np.abs(np.abs(np.asarray(value)) - np.abs(np.asarray(other)))
        found[name] = (share * change).tolist()
    return found
