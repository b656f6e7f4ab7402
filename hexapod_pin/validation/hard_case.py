"""Cases as data, and their one runner: hard cases, checks of formulations, what is not covered."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from hexapod_pin.errors import (
    HexapodError,
    MissingPackageError,
    SimulationInterrupted,
    UnknownNameError,
)
from hexapod_pin.validation.case_result import CaseResult, ExpectedValue, expected_failure
from hexapod_pin.validation.solver_setting import TIGHT, SolverSetting

FAILURES = (HexapodError, ArithmeticError, ValueError, np.linalg.LinAlgError)
"""What a wrong formula may end in; such a comparison has failed, and its result names the error."""


@dataclass(frozen=True)
class Trial:
    """One scene of a case, solved in variants and by several methods.

    Attributes:
        run: gets a setting (None where nothing is integrated) and the arguments of a variant;
            yields the expected values with the errors it found.
        settings: what it is solved by; (None,) where nothing is integrated.
        full_only: settings that quick runs leave out, such as those below a method's reach.
        variants: arguments of `run`, one tuple each.
        quick_settings: how many of `settings` a quick run takes.
        quick_variants: how many of `variants` it takes; None: all.
        slow: left out of quick runs.
        label: method of the result where nothing is integrated.
    """

    run: Callable[..., Iterable[ExpectedValue]]
    settings: Sequence[SolverSetting | None] = TIGHT
    full_only: Sequence[SolverSetting] = ()
    variants: Sequence[tuple[Any, ...]] = ((),)
    quick_settings: int = 1
    quick_variants: int | None = None
    slow: bool = False
    label: str = "closed form"

    def results(self, case: str, quick: bool) -> Iterator[CaseResult]:
        """Yield a result per expected value, or one with the error of a run that fails."""
        if quick and self.slow:
            return
        every = (*self.settings, *self.full_only)
        for setting in self.settings[: self.quick_settings] if quick else every:
            method = self.label if setting is None else str(setting)
            for variant in self.variants[: self.quick_variants] if quick else self.variants:
                try:
                    for value in self.run(setting, *variant):
                        yield CaseResult(
                            case, value.what, method, value.error, value.tolerance, value.unit,
                            value.note, expected_failure(case, value.what, method),
                        )  # fmt: skip
                except SimulationInterrupted:
                    raise
                except FAILURES as error:
                    what = f"{self.run.__name__.strip('_').replace('_', ' ')} {variant or ''}"
                    note = f"{type(error).__name__}: {error}"
                    yield CaseResult(case, what, method, math.inf, 0.0, "", note)


@dataclass(frozen=True)
class NotCovered:
    """A part of a case that the package cannot represent."""

    what: str
    why: str

    def results(self, case: str, quick: bool) -> Iterator[CaseResult]:
        """Yield the one result: not run."""
        yield CaseResult.not_run(case, self.what, "-", f"cannot be represented, {self.why}")


@dataclass(frozen=True)
class HardCase:
    """A hard case: its id, what it is hard on, and its trials."""

    name: str
    hard_on: str
    trials: tuple[Trial | NotCovered, ...]

    def results(self, quick: bool) -> Iterator[CaseResult]:
        """Yield the results of all trials."""
        for trial in self.trials:
            yield from trial.results(self.name, quick)


@dataclass(frozen=True)
class Check:
    """One comparison of two independent answers, where nothing is varied.

    Attributes:
        name: short and unique.
        what: what is compared with what.
        run: returns the error.
        tolerance: largest error allowed.
        unit: of both; "" for a relative error.
        source: equation, hard case or paper.
    """

    name: str
    what: str
    run: Callable[[], float]
    tolerance: float
    unit: str = ""
    source: str = ""

    def results(self, quick: bool = False) -> Iterator[CaseResult]:
        """Yield the one result."""
        error, note = math.inf, ""
        try:
            error = float(self.run())
        except SimulationInterrupted:
            raise
        except MissingPackageError as missing:
            yield CaseResult.not_run(self.name, self.what, self.source, str(missing))
            return
        except FAILURES as failure:
            note = f"{type(failure).__name__}: {failure}"
        yield CaseResult(
            self.name, self.what, self.source, error, self.tolerance, self.unit, note,
            expected_failure(self.name, self.what, self.source),
        )  # fmt: skip


class ValidationCase(Protocol):
    """What the runner takes: a `HardCase` or a `Check`."""

    @property
    def name(self) -> str:
        """Its id."""
        ...

    def results(self, quick: bool) -> Iterator[CaseResult]:
        """Yield its results."""
        ...


def run_cases(
    cases: Sequence[ValidationCase], *, quick: bool = False,
    progress: Callable[[float], None] | None = None,
) -> list[CaseResult]:  # fmt: skip
    """Run cases one after the other.

    Args:
        cases: hard cases or checks.
        quick: fewer settings and variants.
        progress: called with the finished fraction (0..1) after every case.

    Returns:
        All results, in order, each with the time it took.

    Raises:
        SimulationInterrupted: Ctrl-C, or a signal that ends the process; `.results` holds what was
            found before.
    """
    found: list[CaseResult] = []
    try:
        for done, case in enumerate(cases, start=1):
            found += _timed(case.results(quick))
            if progress is not None:
                progress(done / len(cases))
    except (KeyboardInterrupt, SimulationInterrupted) as error:
        text = f"interrupted; {done - 1} of {len(cases)} cases are done"
        raise SimulationInterrupted(text, None, results=found) from error
    return found


def _timed(results: Iterator[CaseResult]) -> list[CaseResult]:
    """Return the results of a case, each with the time it took."""
    found, begin = [], time.perf_counter()
    for result in results:
        now = time.perf_counter()
        found.append(replace(result, seconds=now - begin))
        begin = now
    return found


def named_cases(
    cases: Sequence[ValidationCase], names: Sequence[str] | None, kind: str
) -> list[ValidationCase]:  # fmt: skip
    """Return the cases with these names, in the order of `cases`; None: all.

    Raises:
        UnknownNameError: there is none of that name.
    """
    known = [case.name for case in cases]
    for name in names or ():
        if name not in known:
            raise UnknownNameError(kind, name, known)
    return [case for case in cases if names is None or case.name in names]
