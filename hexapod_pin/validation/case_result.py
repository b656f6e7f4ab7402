"""A case result records a comparison with a known answer; expected failures are registered."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

# The one registry of expected failures: rows of tables that are known to miss their number.

REGISTRY = Path(__file__).resolve().parent / "data" / "expected_failures.json"

MAX_GROWTH = 3.0
"""An error beyond so many times the registered one is a failure that nobody expected."""


@dataclass(frozen=True)
class ExpectedFailure:
    """A row that is known to miss its number.

    Attributes:
        case: id of the hard case, or name of the check.
        what: the number, as in its row.
        method: method and setting, as in its row.
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


# What a comparison with a known answer found: the one record of hard cases and checks.

Kind = Literal["pass", "FAIL", "expected failure", "unexpected pass", "not run"]

BAD_KINDS = ("FAIL", "unexpected pass")
"""Kinds of results that fail a table."""


@dataclass(frozen=True)
class ExpectedValue:
    """A number that a run is compared in, and how near to its expected value it came.

    Attributes:
        what: the number, with its parameters.
        error: distance from the expected value, in the unit of `unit`.
        tolerance: largest error allowed.
        unit: of both; "" for a relative error.
        note: how, where it is not obvious.
    """

    what: str
    error: float
    tolerance: float
    unit: str = ""
    note: str = ""


@dataclass(frozen=True)
class CaseResult:
    """One number compared with its exact or reference value.

    Attributes:
        case: id of the hard case, or name of the check.
        what: the number, with its parameters.
        method: method and setting it was computed with; of a check its source: equation or paper.
        error: distance from the answer, in the unit of `unit`; infinite where the run failed; nan
            for what was not run.
        tolerance: largest error allowed; nan for what was not run.
        unit: of both; "" for a relative error.
        note: how, where it is not obvious; with what the run failed; or why it was not run.
        expected: entry of the registry of expected failures; None where it must pass.
        seconds: what it took.
    """

    case: str
    what: str
    method: str
    error: float
    tolerance: float
    unit: str = ""
    note: str = ""
    expected: ExpectedFailure | None = None
    seconds: float = 0.0

    @classmethod
    def not_run(cls, case: str, what: str, method: str, why: str) -> CaseResult:
        """Return the result of what was not run: software not installed, no such scene."""
        return cls(case, what, method, math.nan, math.nan, note=why)

    @property
    def computed(self) -> bool:
        """Whether there is an error to judge."""
        return not math.isnan(self.tolerance)

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance; nan is not."""
        return self.error <= self.tolerance

    @property
    def kind(self) -> Kind:
        """Return what became of the row."""
        if not self.computed:
            return "not run"
        if self.expected is None:
            return "pass" if self.passed else "FAIL"
        if self.passed:
            return "unexpected pass"
        return "expected failure" if self.error <= self.expected.limit else "FAIL"

    @property
    def failed(self) -> bool:
        """Whether it fails its table: a miss that is not registered, or a registered one met."""
        return self.kind in BAD_KINDS

    @property
    def verdict(self) -> str:
        """Return the kind, with the reason of what is not a plain pass or FAIL."""
        kind = self.kind
        if kind == "not run":
            return f"{kind}: {self.note}"
        if self.expected is None:
            return kind
        if kind == "FAIL":
            return f"FAIL: expected to reach {self.expected.reached:.1e} ({self.expected.reason})"
        return f"{kind}: {self.expected.reason}"


def relative(found: float, expected: float) -> float:
    """Return |found - expected| / |expected|."""
    return abs(found - expected) / abs(expected)
