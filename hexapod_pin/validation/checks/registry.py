"""Every check of this package, by module, and MuJoCo's equations of motion beside ours.

Every module whose name ends in `_checks` may hold CHECKS, a sequence of `Check`; `all_checks` finds
them, so a new formulation brings its own without touching anything here.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Sequence

from hexapod_pin.validation.case_result import CaseResult
from hexapod_pin.validation.hard_case import Check, ValidationCase, named_cases, run_cases


def all_checks() -> list[Check]:
    """Return the checks of every module `*_checks` of this package, module by module."""
    import hexapod_pin.validation.checks as package

    names = sorted(m.name for m in pkgutil.iter_modules(package.__path__))
    modules = [importlib.import_module(f"{package.__name__}.{name}") for name in names
               if name.endswith("_checks")]  # fmt: skip
    return [check for module in modules for check in getattr(module, "CHECKS", ())]


def run_checks(
    *, names: Sequence[str] | None = None, everything: bool = False,
    progress: Callable[[float], None] | None = None,
) -> list[CaseResult]:  # fmt: skip
    """Run the checks.

    Args:
        names: of checks; None: all.
        everything: MuJoCo, where it is installed, and the hard cases in quick form too.
        progress: called with the finished fraction (0..1).

    Raises:
        UnknownNameError: there is no such check.
    """
    cases: list[ValidationCase] = named_cases(all_checks(), names, "check")
    if everything:
        from hexapod_pin.validation.cases.registry import HARD_CASES
        from hexapod_pin.validation.checks.mujoco_terms import MUJOCO_CHECK

        cases += [MUJOCO_CHECK, *HARD_CASES]
    return run_cases(cases, quick=True, progress=progress)
