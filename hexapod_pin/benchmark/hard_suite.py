"""The suite of `hexapod-pin bench --hard`: hard cases, random extremes, calibration of accuracy."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from hexapod_pin.benchmark.calibration import (
    ACCURACIES,
    calibrate,
    calibration_table,
    largest_cost_ratio,
    random_tasks,
)
from hexapod_pin.errors import SimulationInterrupted
from hexapod_pin.text_table import Table
from hexapod_pin.validation.case_result import CaseResult, unused_entries
from hexapod_pin.validation.cases.registry import HARD_CASES, run_hard_cases
from hexapod_pin.validation.machine import Machine
from hexapod_pin.validation.stress import STEPS, run_stress_set, stress_table
from hexapod_pin.validation.tables import result_table, summary, worst_results

INTRODUCTION = """# Hard cases

Scenes with a known answer, each hard on one thing; random extreme scenes, which may neither
leave the finite world nor gain energy; and random drops and walks, where the error made is held
against the accuracy asked for. Written by `hexapod-pin bench --hard --out FILE.md`;
`tests/test_hard_cases.py`, `tests/test_stress.py` and `tests/test_tolerance_calibration.py` run a
part of it.

Answers: closed forms and extended precision (`hexapod_pin/validation/data/hardcases.json`); for
HC40 mid and stiff `hc40_references.json`, SciPy's DOP853 over Pinocchio's ABA, which shares with
this package the URDF and nothing else. Of each case and method the table shows the result nearest
to its tolerance, or farthest beyond it. **pass**: within the tolerance. **FAIL**: not.
**expected failure**: not, and registered with its reason and the error it reaches in
`hexapod_pin/validation/data/expected_failures.json`; beyond three times that error it is a FAIL.
**unexpected pass**: registered, but within the tolerance: the entry must go. **not run**: why not.
The command's exit status is 0 only where every row that ran is a pass or an expected failure.
"""


@dataclass(frozen=True)
class SuiteSize:
    """How much to run.

    Attributes:
        scenes: random extreme scenes at each step.
        drops: random drops of the calibration; as many walks.
        accuracies: requested there [m, rad].
        quick: the hard cases with fewer settings and variants.
    """

    scenes: int = 2000
    drops: int = 18
    accuracies: tuple[float, ...] = ACCURACIES
    quick: bool = False


QUICK_SIZE = SuiteSize(scenes=60, drops=2, accuracies=(1e-3, 1e-4, 1e-5), quick=True)

Tick = Callable[[float], None]


@dataclass(frozen=True)
class SuitePart:
    """One part of the suite: its table, one line that sums it up, and how many results failed.

    `interrupted`: what ended the part before its time, if anything did.
    """

    table: Table
    summary: str
    failed: int
    interrupted: SimulationInterrupted | None = None


def suite_parts(quick: bool) -> Iterator[tuple[str, Callable[[Tick], SuitePart]]]:
    """Yield the title of every part, and what runs it; it gets a callable for its progress."""
    size = QUICK_SIZE if quick else SuiteSize()
    yield "hard cases", lambda tick: _cases(size, tick)
    yield "random extremes", lambda tick: _extremes(size, tick)
    yield "accuracy asked for and kept", lambda tick: _calibration(size, tick)


def _cases(size: SuiteSize, tick: Tick) -> SuitePart:
    stopped = None
    try:
        results = run_hard_cases(quick=size.quick, progress=tick)
    except SimulationInterrupted as error:
        results, stopped = list(error.results or ()), error
    if not size.quick and stopped is None:
        results += entries_without_row(results)
    failed = sum(result.failed for result in results)
    text = summary(results) + ("" if stopped is None else f"; {stopped}")
    return SuitePart(result_table(worst_results(results), "Hard cases"), text, failed, stopped)


def entries_without_row(results: Sequence[CaseResult]) -> list[CaseResult]:
    """Return a failed result for every registered expected failure that no row of these is."""
    names = {case.name for case in HARD_CASES}
    rows = ((result.case, result.what, result.method) for result in results)
    return [
        CaseResult(
            entry.case, entry.what, entry.method, math.inf, 0.0,
            note="registered as an expected failure, but there is no such row",
        )
        for entry in unused_entries(rows)
        if entry.case in names
    ]  # fmt: skip


def _extremes(size: SuiteSize, tick: Tick) -> SuitePart:
    found = run_stress_set(size.scenes, STEPS, tick)
    runs = [outcome for own in found.values() for outcome in own]
    failed = sum(not outcome.passed for outcome in runs)
    return SuitePart(stress_table(found), f"{len(runs) - failed} pass, {failed} FAIL", failed)


def _calibration(size: SuiteSize, tick: Tick) -> SuitePart:
    tasks = random_tasks(drops=size.drops, walks=size.drops)
    rows = calibrate(tasks, accuracies=size.accuracies, progress=tick)
    failed = sum(not row.kept for row in rows)
    text = (
        f"{len(rows) - failed} pass, {failed} FAIL; a looser run costs at most "
        f"{largest_cost_ratio(rows):.2f} times a tighter one"
    )
    return SuitePart(calibration_table(rows), text, failed)


def suite_page(machine: Machine, parts: list[SuitePart]) -> str:
    """Return the suite as a Markdown page."""
    sections = (
        f"\n## {part.table.title}\n\n{part.summary}\n\n{part.table.markdown()}" for part in parts
    )
    return f"{INTRODUCTION}\n{machine}\n{''.join(sections)}"
