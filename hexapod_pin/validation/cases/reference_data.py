"""The reference answers of the hard cases."""

from __future__ import annotations

import json
from functools import lru_cache
from typing import Any

from hexapod_pin.validation.cases.robots import DATA

G = 9.81
"""[m/s^2]"""


@lru_cache(maxsize=1)
def references() -> dict[str, Any]:
    """Return the catalogue: by case its set-up, answers and tolerance, SI unless it says so."""
    data: dict[str, Any] = json.loads((DATA / "hardcases.json").read_text(encoding="utf-8"))
    return data


def answers(case: str) -> dict[str, Any]:
    """Return the answers of the case whose name begins with this id and "_"."""
    [found] = [value for name, value in references().items() if name.startswith(f"{case}_")]
    ref: dict[str, Any] = found["ref"]
    return ref
