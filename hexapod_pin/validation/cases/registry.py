"""The hard cases as a suite of their own: `run_hard` computes every row of their table.

A case is data (`HardCase`: what it tries, how its rows are computed); the cases stand by subject in
the modules of this package. Reference answers: `validation/data/`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hexapod_pin.errors import UnknownNameError
from hexapod_pin.validation.cases import (
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
from hexapod_pin.validation.cases.case_result import HardCase, HardRow

__all__ = ["HARD_CASES", "HardCase", "HardRow", "run_hard"]

_MODULES = (
    impact, slope, flight, linkage, stance, ground, robot,
    scaling, mirror, drop,
)  # fmt: skip


def _number(case: HardCase) -> tuple[int, str]:
    digits = "".join(c for c in case.name if c.isdigit())
    return int(digits), case.name


HARD_CASES: tuple[HardCase, ...] = tuple(
    sorted((case for module in _MODULES for case in module.CASES), key=_number)
)
"""All cases, by number."""


def run_hard(
    *, quick: bool = False, progress: Callable[[float], None] | None = None,
    names: Sequence[str] | None = None,
) -> list[HardRow]:  # fmt: skip
    """Run the hard cases.

    Args:
        quick: one method per case and fewer variants.
        progress: called with the finished fraction (0..1) after every case.
        names: ids of the cases to run; None: all.

    Returns:
        The rows of all cases, in order.

    Raises:
        UnknownNameError: there is no such case.
    """
    known = [case.name for case in HARD_CASES]
    for name in names or ():
        if name not in known:
            raise UnknownNameError("hard case", name, known)
    chosen = [case for case in HARD_CASES if names is None or case.name in names]
    rows: list[HardRow] = []
    for done, case in enumerate(chosen, start=1):
        rows.extend(case.rows(quick))
        if progress is not None:
            progress(done / len(chosen))
    return rows
