"""Numbers that JSON can hold."""

from __future__ import annotations

import math
from typing import Any


def without_non_finite(value: Any) -> Any:
    """Return nested data with None in place of NaN and infinities."""
    if isinstance(value, dict):
        return {key: without_non_finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_non_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
