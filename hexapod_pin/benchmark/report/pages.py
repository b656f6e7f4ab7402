"""A report as Markdown, CSV or JSON; machine, versions and date stand in each."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.benchmark.report.tables import has_engines, tables
from hexapod_pin.benchmark.work_precision.comparison import Comparison
from hexapod_pin.benchmark.work_precision.entry import ReferenceSolution
from hexapod_pin.benchmark.work_precision.measure import BenchmarkRow
from hexapod_pin.foreign_text import csv_cell, encoded
from hexapod_pin.results.file_ending import check_ending
from hexapod_pin.results.plain_json import without_non_finite
from hexapod_pin.spec import Spec
from hexapod_pin.validation.machine import Machine
from hexapod_pin.validation.tables import Table

HOW_TO_READ = """This page is written by the command above with `--out`.

- The **error** is the largest difference from a reference over samples and coordinates: base [m],
  turn of the trunk [rad], joints [rad]. **trunk** is the trunk's distance [m]. The reference is a
  run of another method at a far tighter setting; a second one checks it.
- **ms**: wall time of the integration alone per simulated second, the median of interleaved rounds.
  **Evaluations** per simulated second: mass matrix, bias, feet with Jacobians and forces at one
  state.
- A level counts only if every tighter setting meets it too. "not reached" carries the error at the
  tightest setting; "not judged": the level is below the reference's own uncertainty.
- **error kept**: the method as `simulate` runs it where nothing is said: repeated finer until the
  error of the whole run is within the accuracy, the first two runs side by side on two threads; its
  evaluations are those of all runs. Without these words: one run, whose steps keep the accuracy.
- **result**: whether the error is within the accuracy asked for. "FAIL": it is not, and the exit
  status of `hexapod-pin bench` is 1. "said so": it is not, and the run's own estimate says so. A
  single run and a fixed step promise nothing. "not run" says why; a run that diverged is a row that
  says so.
- `hexapod-pin bench SCENE --advise 1e-4` measures a scene of your own and names the cheapest method
  and setting for it."""


@dataclass(frozen=True)
class BenchmarkReport:
    """What was measured, where and how.

    Attributes:
        machine: where and when.
        command: how it was asked for.
        scenes: one comparison per scene.
    """

    machine: Machine
    command: str
    scenes: Sequence[Comparison]


def facts(comparison: Comparison) -> list[str]:
    """Return what must be known to read a scene's tables, one line each."""
    task = comparison.task
    contact, servo = task.scene.contact, task.scene.servos
    lines = [
        f"{task.about}; {task.duration:g} s, compared every {task.sample * 1e3:g} ms",
        f"{task.scene.robot.name}, {task.scene.robot.total_mass:.4g} kg; "
        f"{_law(contact.normal)}; {_law(contact.friction)}; servo {servo.describe()}",
        *(_truth(reference) for reference in comparison.references),
        *comparison.notes,
    ]
    if comparison.interrupted:
        lines.append("INTERRUPTED: rows are missing, times are of fewer rounds")
    return lines


def _law(law: Spec) -> str:
    """Return a law's kind and numbers, SI."""
    own = law.model_dump()
    numbers = [f"{name} {x:g}" for name, x in own.items() if isinstance(x, float)]
    return f"{own['kind']} ({', '.join(numbers)})"


def _truth(reference: ReferenceSolution) -> str:
    uncertainty = reference.uncertainty
    size = (
        f"{uncertainty.trunk:.1e} m (trunk)"
        if math.isnan(uncertainty.q)
        else f"{uncertainty.q:.1e}"
    )
    return f"reference: {reference.text}; its distance from {reference.check}: {size}"


def markdown(report: BenchmarkReport) -> str:
    """Return the report as a Markdown page."""
    head = f"# Speed against error\n\n`{report.command}`\n\n{report.machine}\n\n{HOW_TO_READ}\n"
    return "\n".join([head, *(_section(scene) for scene in report.scenes)])


def _section(comparison: Comparison) -> str:
    lines = "".join(f"- {line}\n" for line in facts(comparison))
    text = f"## {comparison.task.name}\n\n{lines}\n"
    *levels, runs = tables(comparison)
    text += "".join(_titled(table) for table in levels)
    if has_engines(comparison):
        text += "### Ratios of wall times\n\n"
        text += "".join(f"- {line}\n" for line in comparison.ratios) + "\n"
    return text + _titled(runs)


def _titled(table: Table) -> str:
    return f"### {table.title}\n\n{table.markdown()}\n"


def scene_text(comparison: Comparison) -> str:
    """Return a scene's facts, tables and ratios as plain text."""
    *levels, runs = tables(comparison)
    lines = [f"\n{comparison.task.name}", *(f"- {line}" for line in facts(comparison)), ""]
    lines += [table.text() for table in (runs, *levels)]
    return "\n".join([*lines, *(comparison.ratios if has_engines(comparison) else ())])


def csv_text(report: BenchmarkReport) -> str:
    """Return every row of every scene; the lines before the table begin with "#"."""
    stream = io.StringIO()
    remarks = [report.command, str(report.machine)]
    remarks += [f"{scene.task.name}: {line}" for scene in report.scenes for line in facts(scene)]
    stream.writelines(f"# {' '.join(line.splitlines())}\n" for line in remarks)
    names = [*(field.name for field in fields(BenchmarkRow)), "verdict"]
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["scene", *names])
    for scene in report.scenes:
        for row in scene.rows:
            values = (scene.task.name, *(getattr(row, name) for name in names))
            writer.writerow([_cell(value) for value in values])
    return stream.getvalue()


def json_text(report: BenchmarkReport) -> str:
    """Return everything; what is not a finite number is null."""
    data = {
        "command": report.command,
        "machine": asdict(report.machine),
        "scenes": [_scene_data(scene) for scene in report.scenes],
    }
    return json.dumps(without_non_finite(data), indent=1, allow_nan=False) + "\n"


def _scene_data(comparison: Comparison) -> dict[str, Any]:
    task = comparison.task
    scene = task.scene.to_dict()
    scene["robot"]["source"] = Path(scene["robot"]["source"]).name
    return {
        "name": task.name,
        "about": task.about,
        "duration": task.duration,
        "sample": task.sample,
        "scene": scene,
        "interrupted": comparison.interrupted,
        "facts": facts(comparison),
        "ratios": comparison.ratios,
        "rows": [{**asdict(row), "verdict": row.verdict} for row in comparison.rows],
    }


WRITERS: dict[str, Callable[[BenchmarkReport], str]] = {
    ".md": markdown, ".csv": csv_text, ".json": json_text,
}  # fmt: skip


def write_report(report: BenchmarkReport, path: Path) -> Path:
    """Write a report in the form that the file's ending names.

    Raises:
        TraceFileError: the ending is not .md, .csv or .json, or the file cannot be written.
    """
    text = WRITERS[check_ending(path, tuple(WRITERS))](report)
    return write_atomically(path, encoded(text))


def _cell(value: Any) -> Any:
    if isinstance(value, str):
        return csv_cell(value)
    return "" if value is None or (isinstance(value, float) and math.isnan(value)) else value
