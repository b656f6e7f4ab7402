"""A comparison as text: one table per scene, a row per metric, a column per controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hexapod_pin.results.compared_run import Outcome
from hexapod_pin.results.estimate import CONFIDENCE, Estimate
from hexapod_pin.results.walk_metrics import METRICS

if TYPE_CHECKING:
    from hexapod_pin.results.comparison import Comparison

NOTHING = "-"


def text_table(comparison: Comparison) -> str:
    """Return plain text."""
    parts = [_heading(comparison)]
    for scene in comparison.scenes:
        rows = scene_rows(comparison, scene)
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        lines = [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        ]
        lines.insert(1, "-" * max(len(line) for line in lines))
        parts.append("\n".join([_title(comparison, scene), *lines]))
    parts += ["\n".join(lines) for lines in (failures(comparison), notes(comparison)) if lines]
    return "\n\n".join(parts)


def markdown_table(comparison: Comparison) -> str:
    """Return Markdown."""
    parts = [_heading(comparison)]
    for scene in comparison.scenes:
        rows = [[_escaped(cell) for cell in row] for row in scene_rows(comparison, scene)]
        rows.insert(1, ["---"] * len(rows[0]))
        table = "\n".join("| " + " | ".join(row) + " |" for row in rows)
        parts += [f"### {_escaped(_title(comparison, scene))}", table]
    for lines in (failures(comparison), notes(comparison)):
        if lines:
            parts.append("\n".join(f"- {_escaped(line)}" for line in lines))
    return "\n\n".join(parts)


def scene_rows(comparison: Comparison, scene: str) -> list[list[str]]:
    """Return the cells of a scene's table, the head first."""
    names = comparison.controllers
    rows = [["", *names], ["runs that walked", *(_walked(comparison, scene, n) for n in names)]]
    for metric, (unit, meaning) in METRICS.items():
        cells = [
            _cell(comparison.mean(scene, name, metric), comparison.change(scene, name, metric))
            for name in names
        ]
        rows.append([f"{meaning} [{unit}]", *cells])
    return rows


def failures(comparison: Comparison) -> list[str]:
    """Return a line for each run that has no numbers."""
    return [
        f"{run.controller} on {run.scene}{_variant(comparison, run.scene, run.number)}: "
        f"{run.outcome.value} ({_first_line(run.reason)})"
        for run in comparison.runs
        if run.outcome is not Outcome.WALKED
    ]


def notes(comparison: Comparison) -> list[str]:
    """Return what to know before using the numbers."""
    lines = []
    if any(_variants(comparison, scene) > 1 for scene in comparison.scenes):
        lines.append(
            f"+-: half of the {100 * CONFIDENCE:.0f} % confidence interval over variants of the "
            "scene (Student's t); changes are paired, variant by variant."
        )
    return lines + [f"assumed: {statement}" for statement in comparison.assumed]


def number_text(value: float) -> str:
    """Return a number to four digits."""
    return f"{value:.4g}"


def change_text(change: Estimate) -> str:
    """Return a relative change in percent."""
    width = "" if change.half_width is None else f" +- {100 * change.half_width:.2g}"
    return f"{100 * change.value:+.3g}{width} %"


def _cell(mean: Estimate | None, change: Estimate | None) -> str:
    if mean is None:
        return NOTHING
    width = "" if mean.half_width is None else f" +- {mean.half_width:.2g}"
    return number_text(mean.value) + width + ("" if change is None else f" ({change_text(change)})")


def _heading(comparison: Comparison) -> str:
    others = comparison.controllers[1:]
    against = f", in brackets: change against {comparison.baseline}" if others else ""
    return "\n".join([f"Comparison of {', '.join(comparison.controllers)}{against}",
                      *comparison.settings])  # fmt: skip


def _title(comparison: Comparison, scene: str) -> str:
    count = _variants(comparison, scene)
    return f"{scene} ({count} variants)" if count > 1 else scene


def _walked(comparison: Comparison, scene: str, controller: str) -> str:
    runs = comparison.of(scene, controller)
    good = sum(run.outcome is Outcome.WALKED for run in runs)
    others = dict.fromkeys(r.outcome.value for r in runs if r.outcome is not Outcome.WALKED)
    said = f": {', '.join(others)}" if others else ""
    return f"{good} of {len(runs)}{said}"


def _variants(comparison: Comparison, scene: str) -> int:
    return len({run.number for run in comparison.runs if run.scene == scene})


def _variant(comparison: Comparison, scene: str, number: int) -> str:
    return f" #{number}" if _variants(comparison, scene) > 1 else ""


def _first_line(text: str) -> str:
    return text.partition("\n")[0]


def _escaped(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
