"""What a comparison with a known answer found: the one record of hard cases and checks."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class ExpectedValue:
    """A number that a run is compared in, and how near to its expected value it came.

    Attributes:
        what: the number, with its parameters.
        error: distance from the expected value, in the unit of `unit`.
        tolerance: largest error allowed.
        unit: of both; "" for a relative error.
        note: how, where it is not obvious.
        expected_miss: why a miss is expected; "" where the tolerance must be held.
    """

    what: str
    error: float
    tolerance: float
    unit: str = ""
    note: str = ""
    expected_miss: str = ""


@dataclass(frozen=True)
class CaseResult:
    """One number compared with its exact or reference value.

    Attributes:
        case: id of the hard case, or name of the check.
        what: the number, with its parameters.
        method: method and setting it was computed with; of a check its source: equation or paper.
        error: distance from the answer, in the unit of `unit`; infinite where the run failed; nan
            for what was not computed.
        tolerance: largest error allowed; nan for what was not computed.
        unit: of both; "" for a relative error.
        note: how, where it is not obvious; or with what the run failed.
        expected_miss: registered reason why a miss is expected; "" where it must pass.
        seconds: what it took.
    """

    case: str
    what: str
    method: str
    error: float
    tolerance: float
    unit: str = ""
    note: str = ""
    expected_miss: str = ""
    seconds: float = 0.0

    @classmethod
    def not_covered(cls, case: str, what: str, why: str) -> CaseResult:
        """Return the result of what the package cannot represent."""
        reason = f"cannot be represented, {why}"
        return cls(case, what, "-", math.nan, math.nan, expected_miss=reason)

    @classmethod
    def skipped(cls, case: str, what: str, method: str, why: str) -> CaseResult:
        """Return the result of a comparison with software that is not installed."""
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
    def kind(self) -> str:
        """Return "pass", "FAIL", "expected miss", "expected to miss, passed" or "skipped"."""
        if self.expected_miss:
            return "expected to miss, passed" if self.passed else "expected miss"
        if not self.computed:
            return "skipped"
        return "pass" if self.passed else "FAIL"

    @property
    def failed(self) -> bool:
        """Whether it must pass and did not."""
        return self.kind == "FAIL"

    @property
    def verdict(self) -> str:
        """Return the kind; of an expected miss "expected: <reason>"."""
        if self.kind == "expected miss":
            return f"expected: {self.expected_miss}"
        return f"skipped: {self.note}" if self.kind == "skipped" else self.kind


def relative(found: float, expected: float) -> float:
    """Return |found - expected| / |expected|."""
    return abs(found - expected) / abs(expected)
