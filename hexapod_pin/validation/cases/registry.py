"""The registry of hard cases: it serves the tests, `hexapod-pin verify` and `bench --hard`.

A case is data (`HardCase`: what it is hard on, its trials); the cases stand by subject in the
modules of this package. Reference answers: `validation/data/`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hexapod_pin.validation.case_result import CaseResult
from hexapod_pin.validation.cases import (
    bounce,
    drop,
    flight,
    ground,
    impact,
    linkage,
    mirror,
    robot,
    scaling,
    slope,
    stance,
)
from hexapod_pin.validation.hard_case import HardCase, named_cases, run_cases

_MODULES = (impact, bounce, slope, flight, linkage, stance, ground, robot, scaling, mirror, drop)


def _number(case: HardCase) -> tuple[int, str]:
    digits = "".join(c for c in case.name if c.isdigit())
    return int(digits), case.name


HARD_CASES: tuple[HardCase, ...] = tuple(
    sorted((case for module in _MODULES for case in module.CASES), key=_number)
)
"""All cases, by number."""


def run_hard_cases(
    *, quick: bool = False, progress: Callable[[float], None] | None = None,
    names: Sequence[str] | None = None,
) -> list[CaseResult]:  # fmt: skip
    """Run the hard cases.

    Args:
        quick: fewer settings and variants, no slow trials.
        progress: called with the finished fraction (0..1) after every case.
        names: ids of the cases to run; None: all.

    Raises:
        UnknownNameError: there is no such case.
    """
    chosen = named_cases(HARD_CASES, names, "hard case")
    return run_cases(chosen, quick=quick, progress=progress)
