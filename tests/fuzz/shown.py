"""What no input may bring about: how it is described, and what is shown to people is finite."""

from __future__ import annotations

import math
import re
import traceback

import numpy as np

import hexapod_pin as hp

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


def require_finite_data(trace: hp.Trace) -> None:
    for name in ("time", "q", "v", "torque", "foot_force", "com"):
        if not np.isfinite(getattr(trace, name)).all():
            raise FaultFound(f"{name} of a run is not finite")


def is_wrong_call(error: Exception) -> bool:
    return isinstance(error, TypeError) and bool(_WRONG_CALL.search(str(error)))


def described(error: Exception) -> str:
    """Return an exception, and where in the package or the campaign it was raised."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if _OURS.match(f.filename)]
    place = f"{_OURS.sub('', frames[-1].filename)}:{frames[-1].lineno}"
    first = (str(error).splitlines() or [""])[0]
    return f"{type(error).__name__}: {first[:100]} at {place}"
