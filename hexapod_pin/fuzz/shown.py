"""What is shown to people must be finite."""

from __future__ import annotations

import math
import re

import numpy as np

import hexapod_pin as hp

_NOT_FINITE = re.compile(r"(?<![\w.'-])[-+]?(?:nan|inf)(?![\w.'-])", re.IGNORECASE)
"""Between quotes it is a text: a name, or what was given."""


def require_finite(text: str, *given: str) -> None:
    """Refuse a text with nan or inf in it, unless they were given.

    Raises:
        ArithmeticError: there is one.
    """
    if any(_NOT_FINITE.search(one) or _is_read_as_not_finite(one) for one in given):
        return
    found = _NOT_FINITE.search(text)
    if found:
        near = text[max(0, found.start() - 40) : found.end() + 20]
        raise ArithmeticError(f"shows {found[0]!r}: ...{near!r}...")


def _is_read_as_not_finite(word: str) -> bool:
    """Tell whether a word is a number that is not finite, such as 1e999: a refusal quotes it."""
    try:
        return not math.isfinite(float(word))
    except ValueError:
        return False


def require_finite_data(trace: hp.Trace) -> None:
    """Refuse a trace whose motion is not finite.

    Raises:
        ArithmeticError: as told.
    """
    for name in ("time", "q", "v", "torque", "foot_force", "com"):
        if not np.isfinite(getattr(trace, name)).all():
            raise ArithmeticError(f"{name} of a run is not finite")
