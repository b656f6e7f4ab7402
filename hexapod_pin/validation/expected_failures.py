"""The one registry of expected failures: rows of tables that are known to miss their number."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

REGISTRY = Path(__file__).resolve().parent / "data" / "expected_failures.json"

MAX_GROWTH = 3.0
"""An error beyond so many times the registered one is a failure that nobody expected."""


@dataclass(frozen=True)
class ExpectedFailure:
    """A row that is known to miss its number.

    Attributes:
        case: id of the hard case, or name of the check.
        what: the number, as its row says.
        method: method and setting, as its row says.
        reason: why it misses.
        reached: the error it makes, in the unit of the row.
    """

    case: str
    what: str
    method: str
    reason: str
    reached: float

    @property
    def limit(self) -> float:
        """Largest error that is still the expected one."""
        return MAX_GROWTH * self.reached


@lru_cache(maxsize=1)
def expected_failures() -> dict[tuple[str, str, str], ExpectedFailure]:
    """Return the registry by case, what and method."""
    data = registry_data()
    rows = (
        ExpectedFailure(case, row["what"], row["method"], reason, row["reached"])
        for case, reasons in data.items()
        for reason, own in reasons.items()
        for row in own
    )
    return {(row.case, row.what, row.method): row for row in rows}


def registry_data() -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Return the file: by case and reason, rows with what, method and the error reached."""
    data: dict[str, dict[str, list[dict[str, Any]]]] = json.loads(
        REGISTRY.read_text(encoding="utf-8")
    )
    return data


def expected_failure(case: str, what: str, method: str) -> ExpectedFailure | None:
    """Return the entry of a row; None where it must meet its number."""
    return expected_failures().get((case, what, method))


def unused_entries(rows: Iterable[tuple[str, str, str]]) -> list[ExpectedFailure]:
    """Return the entries without a row among these (case, what, method)."""
    found = set(rows)
    return [entry for key, entry in expected_failures().items() if key not in found]
