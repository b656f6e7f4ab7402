"""A measured comparison is reported as tables, Markdown, CSV, JSON or a figure."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.benchmark.work_precision.comparison import Comparison
from hexapod_pin.benchmark.work_precision.measure import (
    LEVELS,
    OURS,
    BenchmarkRow,
    Measure,
    ReferenceSolution,
    cheapest,
    resolved,
    sweeps,
)
from hexapod_pin.foreign_text import csv_cell, encoded
from hexapod_pin.results.result_files import check_ending, without_non_finite
from hexapod_pin.spec import Spec
from hexapod_pin.text_table import Table
from hexapod_pin.validation.machine import Machine
from hexapod_pin.validation.solver_setting import KEPT
from hexapod_pin.view.figure_file import figure_bytes, figure_format

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# The tables of a report as plain rows of text, for the terminal and for Markdown alike.


def tables(comparison: Comparison) -> list[Table]:
    """Return the tables of one scene: cost by level, and every run."""
    found = [level_table(comparison, "error")]
    if has_engines(comparison):
        found.append(level_table(comparison, "trunk"))
    kept = kept_table(comparison)
    return [*found, *([kept] if kept.rows else []), run_table(comparison)]


def has_engines(comparison: Comparison) -> bool:
    """Tell whether another engine has rows."""
    return any(row.engine != OURS for row in comparison.rows)


def level_table(comparison: Comparison, measure: Measure) -> Table:
    """Return the cheapest setting of every method at every level.

    With "error" ours alone are compared, by all positions; with "trunk" all engines.
    """
    what = "any position [m, rad]" if measure == "error" else "the trunk's place [m]"
    groups = {
        name: own
        for name, own in sweeps(comparison.rows).items()
        if measure == "trunk" or name[0] == OURS
    }
    levels = LEVELS if measure == "error" else LEVELS[:4]
    rows = tuple(
        (_name(engine, method), *(_number_cell(own, level, measure) for level in levels))
        for (engine, method), own in groups.items()
    )
    title = f"Cost to reach an error of {what}: ms per simulated second (evaluations)"
    return Table(title, ("method", *(f"{level:.0e}" for level in levels)), rows)


def kept_table(comparison: Comparison) -> Table:
    """Return the requested and the true error, and the cost over that of a single run."""
    groups = sweeps(comparison.rows)
    rows = []
    for (engine, method), own in groups.items():
        single = {row.value: row for row in groups.get((engine, method.removesuffix(KEPT)), [])}
        if method.endswith(KEPT):
            rows += [_kept(row, single.get(row.value)) for row in own]
    head = (
        "method", "error asked for [m, rad]", "error got", "over asked", "own estimate over got",
        "wall time over a single run's", "evaluations over a single run's", "result",
    )  # fmt: skip
    return Table("Error asked for, error got", head, tuple(rows))


def _kept(row: BenchmarkRow, single: BenchmarkRow | None) -> tuple[str, ...]:
    """Return a row of `kept_table`; the single run is the one of the same accuracy."""
    ratios = (row.error / row.value, row.estimate / max(row.error, row.uncertainty))
    costs = ("-", "-")
    if single is not None and single.ended and row.evaluations and single.evaluations:
        costs = (
            f"{row.wall / single.wall:.2f}", f"{row.evaluations / single.evaluations:.2f}",
        )  # fmt: skip
    return (
        row.method.removesuffix(KEPT), f"{row.value:.0e}", _error(row.error),
        *(f"{ratio:.2g}" if math.isfinite(ratio) else "-" for ratio in ratios), *costs, row.verdict,
    )  # fmt: skip


def run_table(comparison: Comparison) -> Table:
    """Return every run: error and cost side by side."""
    head = (
        "method", "setting", "error [m, rad]", "own estimate", "trunk [m]", "ms per s", "runs",
        "evaluations per s", "steps per s", "rejected per s", "result", "note",
    )  # fmt: skip
    rows = tuple(_run(row) for row in comparison.rows)
    return Table("Every run", head, rows)


def _run(row: BenchmarkRow) -> tuple[str, ...]:
    counts = (row.evaluations, row.steps, row.rejected)
    return (
        _name(row.engine, row.method), row.setting, _error(row.error),
        _error(row.estimate), _error(row.trunk),
        f"{row.wall * 1e3:.3g}" if math.isfinite(row.wall) else "-", str(row.runs),
        *(_count(count) for count in counts), row.verdict, "" if row.refused else row.note,
    )  # fmt: skip


def _number_cell(own: list[BenchmarkRow], level: float, measure: Measure) -> str:
    """Return "5.6 (1.9k)", or why there is none: level not reached, reference not certain."""
    if not resolved(own, level):
        return f"not judged: reference {max(row.uncertainty for row in own):.0e}"
    row = cheapest(own, level, measure)
    if row is None:
        return f"not reached: {_tightest(own, measure)}"
    cost = f"{row.wall * 1e3:.3g}"
    return cost if row.evaluations is None else f"{cost} ({_count(row.evaluations)})"


def _tightest(own: list[BenchmarkRow], measure: Measure) -> str:
    """Return the error at the tightest setting, or that its run did not end."""
    error = getattr(own[-1], measure)
    return f"{error:.0e}" if math.isfinite(error) else "did not end"


def row_name(row: BenchmarkRow) -> str:
    """Return method, setting and what became of it."""
    return f"{_name(row.engine, row.method)}, {row.setting} ({row.verdict})"


def _name(engine: str, method: str) -> str:
    return method if engine == OURS else f"{engine} {method}"


def _error(value: float) -> str:
    return f"{value:.1e}" if math.isfinite(value) else "-"


def _count(value: float | None) -> str:
    """Return a count with three digits, in thousands where it is large."""
    if value is None:
        return "-"
    for scale, letter in ((1e6, "M"), (1e3, "k")):
        if value >= scale:
            return f"{value / scale:.3g}{letter}"
    return f"{value:.0f}"


# A report as Markdown, CSV or JSON; machine, versions and date stand in each.

HOW_TO_READ = """This page is written by the command above with `--out`.

- The **error** is the largest difference from a reference over samples and coordinates: base [m],
  turn of the trunk [rad], joints [rad]. **trunk** is the trunk's distance [m]. The reference is a
  run of another method at a far tighter setting; a second one checks it.
- **ms**: wall time of the integration alone per simulated second, the median of interleaved rounds.
  **Evaluations** per simulated second: mass matrix, bias, feet with Jacobians and forces at one
  state.
- A level counts only if every tighter setting meets it too. "not reached" carries the error at the
  tightest setting; "not judged": the level is below the reference's own uncertainty.
- **error kept**: the method as `simulate` runs it where nothing is said: one run that knows its own
  error, or runs that are finer each time until the error of the whole run is within the accuracy,
  the first two side by side on two threads; its evaluations are those of all runs. Without these
  words: one run, whose steps keep the accuracy.
- **result**: whether the error is within the accuracy asked for. "FAIL": it is not, and the exit
  status of `hexapod-pin bench` is 1. "error reported": it is
  not, and the run's own estimate reports that. A single run and a fixed step promise nothing. "not
  run" says why; a run that diverged is a row that says so.
- `hexapod-pin bench SCENE --advise 1e-4` measures a scene of your own and names the cheapest method
  and setting for it."""


@dataclass(frozen=True)
class BenchmarkReport:
    """What was measured, where and how.

    Attributes:
        machine: where and when.
        command: that requested it.
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
    """Return a scene's advice, tables, facts and ratios as plain text, what decides first."""
    *levels, runs = tables(comparison)
    about = [line for line in facts(comparison) if line not in comparison.notes]
    lines = [comparison.task.name, *comparison.notes, *(table.text() for table in levels)]
    lines += [*(f"- {line}" for line in about), "", runs.text()]
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


# Error against cost and against the requested accuracy, drawn: a row per scene.

MARKERS = "osD^vP*X<>hd"


def write_plot(report: BenchmarkReport, path: Path) -> Path:
    """Draw a report into a file.

    Raises:
        ParameterError: the ending is not .png, .svg or .pdf.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    return write_atomically(path, figure_bytes(draw(report.scenes, report.machine), ending))


def draw(scenes: Sequence[Comparison], machine: Machine) -> Figure:
    """Return the figure."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(17.0, 4.6 * len(scenes) + 0.4), layout="constrained")
    figure.suptitle(f"{machine.date}, {machine.cpu}", fontsize="small")
    panels = figure.subplots(len(scenes), 3, squeeze=False)
    for (left, right, asked), scene in zip(panels, scenes, strict=True):
        _draw_scene(left, right, scene)
        _draw_asked(asked, scene)
        lines, names = left.get_legend_handles_labels()
        asked.legend(lines, names, fontsize="x-small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _draw_asked(axes: Axes, scene: Comparison) -> None:
    """Draw the true error over the requested accuracy, with the diagonal."""
    for k, ((engine, method), own) in enumerate(sweeps(scene.rows).items()):
        done = [row for row in own if row.ended and row.setting.startswith("accuracy")]
        if engine != OURS or not done:
            continue
        kept = method.endswith(KEPT)
        asked, got = [row.value for row in done], [row.error for row in done]
        axes.loglog(
            asked, got, marker=MARKERS[k % len(MARKERS)], markersize=4.0, color=f"C{k % 10}",
            linestyle="-" if kept else ":", linewidth=1.8 if kept else 0.9,
        )  # fmt: skip
        axes.loglog(asked, asked, color="black", linewidth=0.8)
    axes.set_xlabel("error asked for [m, rad]")
    axes.set_ylabel("error got [m, rad]")
    axes.set_title("black: what was asked for", fontsize="small")
    axes.grid(True, which="major", alpha=0.3)


def _draw_scene(left: Axes, right: Axes, scene: Comparison) -> None:
    """Draw one line per method; all positions, or the trunk where other engines take part."""
    measure = "trunk" if has_engines(scene) else "error"
    for k, ((engine, method), own) in enumerate(sweeps(scene.rows).items()):
        done = [row for row in own if row.ended]
        style = {
            "marker": MARKERS[k % len(MARKERS)], "markersize": 4.0, "color": f"C{k % 10}",
            "linestyle": "-" if engine == OURS else "--",
            "linewidth": 1.8 if engine == OURS else 0.9,
            "label": method if engine == OURS else f"{engine} {method}",
        }  # fmt: skip
        errors = [getattr(row, measure) for row in done]
        left.loglog([row.wall * 1e3 for row in done], errors, **style)
        counted = [row for row in done if row.evaluations]
        if counted:
            counts = [row.evaluations for row in counted]
            right.loglog(counts, [getattr(row, measure) for row in counted], **style)
    unit = "trunk error [m]" if measure == "trunk" else "error [m, rad]"
    for axes, cost in ((left, "wall time [ms]"), (right, "evaluations")):
        axes.set_xlabel(f"{cost} per simulated second")
        axes.set_ylabel(unit)
        axes.grid(True, which="major", alpha=0.3)
    left.set_title(scene.task.name)
