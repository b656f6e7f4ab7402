"""Error against cost and against what was asked for, drawn: a row per scene."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.benchmark.report.pages import BenchmarkReport
from hexapod_pin.benchmark.report.tables import has_engines
from hexapod_pin.benchmark.work_precision.entry import OURS
from hexapod_pin.benchmark.work_precision.tolerance_sweep import sweeps
from hexapod_pin.validation.machine import Machine
from hexapod_pin.validation.solver_setting import KEPT
from hexapod_pin.view.figure_file import figure_bytes, figure_format

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hexapod_pin.benchmark.work_precision.comparison import Comparison

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
    """Draw the error got over the error asked for, with the diagonal."""
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
