"""A comparison as data, what it found, and where all comparisons come from.

Every module of this package whose name ends in `_checks` may hold CHECKS, a sequence of `Check`;
`all_checks` finds them, so a new formulation brings its own without touching anything here.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from hexapod_pin.errors import HexapodError

ENDING = "_checks"
FAILURES = (HexapodError, ArithmeticError, ValueError, np.linalg.LinAlgError)
"""What a wrong formula may end in; such a check has failed, and says with what."""


@dataclass(frozen=True)
class Check:
    """One comparison of two independent answers.

    Attributes:
        name: short and unique.
        what: what is compared with what.
        run: returns the error.
        tolerance: largest error allowed.
        unit: of both; "relative" where there is none.
        source: equation, hard case or paper.
    """

    name: str
    what: str
    run: Callable[[], float]
    tolerance: float
    unit: str = "relative"
    source: str = ""


@dataclass(frozen=True)
class Row:
    """What a comparison found.

    Attributes:
        name: of the check.
        what: what was compared.
        error: in `unit`; infinite where it could not be computed.
        tolerance: largest error allowed; nan for a row that could not be run at all.
        unit: of both.
        source: equation, hard case or paper.
        seconds: what it took.
        note: why it failed, or was not run.
    """

    name: str
    what: str
    error: float
    tolerance: float
    unit: str
    source: str
    seconds: float
    note: str = ""

    @property
    def skipped(self) -> bool:
        """Whether it was not run."""
        return math.isnan(self.tolerance)

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance; nan is not."""
        return self.error <= self.tolerance


def all_checks() -> list[Check]:
    """Return the checks of every module `*_checks` of this package, module by module."""
    import hexapod_pin.validation.checks as package

    names = sorted(m.name for m in pkgutil.iter_modules(package.__path__))
    modules = [importlib.import_module(f"{package.__name__}.{name}") for name in names
               if name.endswith(ENDING)]  # fmt: skip
    return [check for module in modules for check in getattr(module, "CHECKS", ())]


def run_check(check: Check) -> Row:
    """Run one comparison."""
    begin, note = time.perf_counter(), ""
    try:
        error = float(check.run())
    except FAILURES as failure:
        error, note = math.inf, f"{type(failure).__name__}: {failure}"
    seconds = time.perf_counter() - begin
    return Row(
        check.name, check.what, error, check.tolerance, check.unit, check.source, seconds, note
    )


def run_checks(
    checks: Iterable[Check], progress: Callable[[float], None] | None = None
) -> list[Row]:
    """Run comparisons one after the other; `progress` gets the finished fraction."""
    listed, rows = list(checks), []
    for done, check in enumerate(listed, start=1):
        rows.append(run_check(check))
        if progress is not None:
            progress(done / len(listed))
    return rows
