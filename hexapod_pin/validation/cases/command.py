"""The job of `hexapod-pin bench --hard`: hard cases, random extremes, honesty of the accuracy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hexapod_pin.benchmark.machine import Machine
from hexapod_pin.benchmark.report import require_ending
from hexapod_pin.benchmark.tables import Table
from hexapod_pin.benchmark.terminal import console, show_table
from hexapod_pin.benchmark.tolerance_calibration import (
    ACCURACIES,
    dearer,
    honesty_table,
    random_tasks,
    study,
)
from hexapod_pin.commands.output_files import writable
from hexapod_pin.commands.progress import progress_bar
from hexapod_pin.validation.cases.registry import run_hard
from hexapod_pin.validation.cases.table import hard_table, summary, worst_rows
from hexapod_pin.validation.stress import STEPS, Outcome, run_stress, stress_scenes

INTRODUCTION = """# Hard cases

Scenes with a known answer, each hard on one thing; random extreme scenes, which may neither
leave the finite world nor gain energy; and random drops and walks, where the error made is held
against the accuracy asked for. Written by `hexapod-pin bench --hard --out FILE.md`;
`tests/test_hard_suite.py`, `tests/test_stress.py` and `tests/test_honesty.py` run a part of it.

Answers: closed forms and extended precision (`validation/data/hardcases.json`); for HC40
mid and stiff `hc40_references.json`, SciPy's DOP853 over Pinocchio's ABA, which shares with
this package the URDF and nothing else. Of each case and method the table shows the row nearest
to its tolerance, or farthest beyond it. **pass**: within the tolerance. **FAIL**: not.
**short**: missed by a method shown beside those that must hold it. **not run**: cannot be
represented, with the reason.
"""

PART = 20
"""Random scenes between two steps of the progress bar."""


@dataclass(frozen=True)
class Size:
    """How much to run.

    Attributes:
        scenes: random extreme scenes at each step.
        drops: random drops of the honesty study; as many walks.
        accuracies: asked for there [m, rad].
        quick: the hard cases by one method each and in fewer variants.
    """

    scenes: int = 2000
    drops: int = 18
    accuracies: tuple[float, ...] = ACCURACIES
    quick: bool = False


QUICK = Size(scenes=60, drops=2, accuracies=(1e-3, 1e-4, 1e-5), quick=True)

Tick = Callable[[float], None]


@dataclass(frozen=True)
class Part:
    """One part of the suite: its table, one line that sums it up, and how many rows failed."""

    table: Table
    summary: str
    failed: int


def hard(*, quick: bool, out: Path | None) -> bool:
    """Run the suite, print its tables and write them to `out` (.md).

    Returns:
        Whether every row passed.

    Raises:
        ParameterError, TraceFileError: `out` cannot be written; refused before anything is run.
    """
    if out is not None:
        require_ending("--out", out, (".md",))
        out = writable("--out", out)
    size, screen, machine = QUICK if quick else Size(), console(), Machine.here()
    screen.print(str(machine), markup=False, soft_wrap=True)
    parts: list[Part] = []
    for title, job in _JOBS:
        with progress_bar(title) as tick:
            parts.append(job(size, tick))
        show_table(parts[-1].table, screen)
        screen.print(parts[-1].summary, markup=False, soft_wrap=True)
    if out is not None:
        out.write_text(_markdown(machine, parts), encoding="utf-8")
        screen.print(f"wrote {out}", markup=False, soft_wrap=True)
    return not any(part.failed for part in parts)


def _cases(size: Size, tick: Tick) -> Part:
    """The catalogue: of each case and method the row nearest to its tolerance, or beyond it."""
    rows = run_hard(quick=size.quick, progress=tick)
    failed = sum(row.verdict == "FAIL" for row in rows)
    return Part(hard_table(worst_rows(rows)), summary(rows), failed)


def _extremes(size: Size, tick: Tick) -> Part:
    """Random extreme scenes with the robust step; see `stress`."""
    scenes = list(stress_scenes(size.scenes))
    rows: list[tuple[str, ...]] = []
    failed, done, whole = 0, 0, len(STEPS) * len(scenes)
    for step in STEPS:
        found: list[Outcome] = []
        for k in range(0, len(scenes), PART):
            found += run_stress(scenes[k : k + PART], step)
            done += len(scenes[k : k + PART])
            tick(done / whole)
        failed += sum(not outcome.passed for outcome in found)
        rows.append(_extreme_row(step, found))
    head = (
        "step [ms]", "runs", "not finite", "energy gain above 1 %", "largest gain [%]",
        "largest rise [%]", "contact injection, most", "outer iterations, mean",
    )  # fmt: skip
    table = Table("Random extreme scenes, method robust, 0.5 s", head, tuple(rows))
    return Part(table, f"{whole - failed} pass, {failed} FAIL", failed)


def _extreme_row(step: float, found: list[Outcome]) -> tuple[str, ...]:
    finite = [outcome for outcome in found if outcome.finite]
    return (
        f"{1e3 * step:g}", str(len(found)), str(len(found) - len(finite)),
        str(sum(not outcome.passed for outcome in finite)),
        f"{100 * max(outcome.gain for outcome in finite):.2g}",
        f"{100 * max(outcome.rise for outcome in finite):.2g}",
        f"{max(outcome.injection for outcome in finite):.1e}",
        f"{sum(outcome.iterations for outcome in finite) / len(finite):.2f}",
    )  # fmt: skip


def _honesty(size: Size, tick: Tick) -> Part:
    tasks = random_tasks(drops=size.drops, walks=size.drops)
    rows = study(tasks, accuracies=size.accuracies, progress=tick)
    failed = sum(not row.kept for row in rows)
    text = (
        f"{len(rows) - failed} pass, {failed} FAIL; a looser run costs at most "
        f"{dearer(rows):.2f} times a tighter one"
    )
    return Part(honesty_table(rows), text, failed)


def _markdown(machine: Machine, parts: list[Part]) -> str:
    text = f"{INTRODUCTION}\n{machine}\n"
    for part in parts:
        head, *rows = [part.table.head, ("---",) * len(part.table.head), *part.table.rows]
        lines = "\n".join(f"| {' | '.join(cells)} |" for cells in (head, *rows))
        text += f"\n## {part.table.title}\n\n{part.summary}\n\n{lines}\n"
    return text


_JOBS: tuple[tuple[str, Callable[[Size, Tick], Part]], ...] = (
    ("hard cases", _cases),
    ("random extremes", _extremes),
    ("accuracy asked for and kept", _honesty),
)
