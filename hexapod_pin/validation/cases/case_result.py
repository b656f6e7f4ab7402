"""A hard case as data, and a row of its table."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

Runner = Callable[[bool], Iterator["HardRow"]]
"""Runs a case, in reduced form if True; yields its rows."""


@dataclass(frozen=True)
class HardRow:
    """One number compared with its exact or reference value.

    Attributes:
        case: id of the hard case.
        what: the number, with its parameters.
        method: method and setting it was computed with.
        error: distance from the answer, in the unit of `unit`; nan for what cannot be run.
        tolerance: largest error allowed.
        unit: of both; "" for a relative error.
        note: how, where it is not obvious; or why it cannot be run.
        required: False for a method that is shown beside those which must hold the tolerance.
    """

    case: str
    what: str
    method: str
    error: float
    tolerance: float
    unit: str = ""
    note: str = ""
    required: bool = True

    @property
    def covered(self) -> bool:
        """Whether it was run at all."""
        return not math.isnan(self.tolerance)

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error <= self.tolerance

    @property
    def verdict(self) -> str:
        """Return "pass", "FAIL", "short" (missed by a method shown for comparison) or "not run"."""
        if not self.covered:
            return "not run"
        if self.passed:
            return "pass"
        return "FAIL" if self.required else "short"


@dataclass(frozen=True)
class HardCase:
    """A hard case.

    Attributes:
        name: id, "HC01b".
        tries: what it is hard on, one line.
        run: computes its rows; None where the package cannot represent it.
        why_not: the reason for that.
    """

    name: str
    tries: str
    run: Runner | None
    why_not: str = ""

    def rows(self, quick: bool) -> Iterator[HardRow]:
        """Yield the rows; one that says why where there is nothing to run."""
        if self.run is None:
            yield HardRow(self.name, self.tries, "-", math.nan, math.nan, note=self.why_not)
        else:
            yield from self.run(quick)


def relative(found: float, wanted: float) -> float:
    """Return |found - wanted| / |wanted|."""
    return abs(found - wanted) / abs(wanted)
