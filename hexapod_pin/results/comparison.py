"""Controllers are compared on the same scenes by means and paired changes, as data and as text."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.result_files import JSON, check_ending
from hexapod_pin.results.schema import require_known
from hexapod_pin.results.walk_metrics import (
    CONFIDENCE,
    METRICS,
    ComparedRun,
    Estimate,
    Outcome,
    mean_estimate,
    relative_change,
)
from hexapod_pin.text_table import Table, escaped, folded

# A comparison as text: one table per scene, a row per metric, a column per controller.

NOTHING = "-"


def text_table(comparison: Comparison) -> str:
    """Return plain text."""
    parts = [_heading(comparison)]
    parts += ["\n".join(scene_table(comparison, scene).lines()) for scene in comparison.scenes]
    parts += ["\n".join(lines) for lines in (failures(comparison), notes(comparison)) if lines]
    return "\n\n".join(parts)


ROWS = 10
"""Rows of the answer at most; `text_table` has all."""

ANSWERED = {
    "measured_speed": "speed",
    "torque_rms": "torque RMS",
    "torque_peak": "torque peak",
    "slip_per_metre": "slip",
}
"""Numbers of the answer, and what they are called there."""

CHANGED = ("torque_rms", "torque_peak", "slip_per_metre")
"""Those whose changes stand in its first lines."""


def answer_lines(comparison: Comparison) -> list[str]:
    """Return what a user decides by: a row for each scene and controller, and who is ahead."""
    names = [name for name in ANSWERED if name in METRICS]
    rows: list[list[str]] = []
    for scene in comparison.scenes:
        for name in comparison.controllers:
            cells = [_short_cell(comparison, scene, name, metric) for metric in names]
            rows.append([scene, name, _walked(comparison, scene, name), *cells])
    units = [f"{ANSWERED[name]}\n[{METRICS[name].unit}]" for name in names]
    head = ["scene", "controller", "walked", *units]
    lines = [line for text in verdicts(comparison) for line in folded(text)]
    lines += Table("", head, rows[:ROWS], "<<<>", rule=False).lines()
    more = [f"{len(rows) - ROWS} more rows"] if len(rows) > ROWS else []
    more += [f"{count} runs without numbers"] if (count := len(failures(comparison))) else []
    more += [f"{len(comparison.assumed)} assumed"] if comparison.assumed else []
    return [*lines, *folded("; ".join([*more, "--full has everything, --json FILE writes it"]))]


def verdicts(comparison: Comparison) -> list[str]:
    """Return a sentence for each controller: how it changes the numbers, over all scenes."""
    base, found = comparison.baseline, []
    for name in comparison.controllers[1:]:
        parts = []
        for metric in CHANGED:
            changes = [comparison.change(scene, name, metric) for scene in comparison.scenes]
            values = [100.0 * change.value for change in changes if change is not None]
            if values:
                low, high = f"{min(values):+.0f}", f"{max(values):+.0f}"
                span = low if low == high else f"{low} to {high}"
                parts.append(f"{ANSWERED[metric]} {span} %")
        text = ", ".join(parts) or "no run that both walked"
        found.append(f"{name} against {base}: {text}")
    if not found:
        walked = _walked(comparison, comparison.scenes[0], base)
        found.append(f"{base}: {walked} walked")
    return found


def _short_cell(comparison: Comparison, scene: str, name: str, metric: str) -> str:
    """Return a mean to three digits."""
    mean = comparison.mean(scene, name, metric)
    return NOTHING if mean is None else f"{mean.value:.3g}"


def markdown_table(comparison: Comparison) -> str:
    """Return Markdown."""
    parts = [_heading(comparison)]
    for scene in comparison.scenes:
        table = scene_table(comparison, scene)
        parts += [f"### {escaped(table.title)}", table.markdown().rstrip()]
    for lines in (failures(comparison), notes(comparison)):
        if lines:
            parts.append("\n".join(f"- {escaped(line)}" for line in lines))
    return "\n\n".join(parts)


def scene_table(comparison: Comparison, scene: str) -> Table:
    """Return the table of a scene."""
    names = comparison.controllers
    rows = [["runs that walked", *(_walked(comparison, scene, n) for n in names)]]
    for metric, one in METRICS.items():
        cells = [
            _cell(comparison.mean(scene, name, metric), comparison.change(scene, name, metric))
            for name in names
        ]
        rows.append([f"{one.meaning} [{one.unit}]", *cells])
    return Table(_title(comparison, scene), ("", *names), rows)


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
    rest = f": {', '.join(others)}" if others else ""
    return f"{good} of {len(runs)}{rest}"


def _variants(comparison: Comparison, scene: str) -> int:
    return len({run.number for run in comparison.runs if run.scene == scene})


def _variant(comparison: Comparison, scene: str, number: int) -> str:
    return f" #{number}" if _variants(comparison, scene) > 1 else ""


def _first_line(text: str) -> str:
    return text.partition("\n")[0]


# Controllers compared on the same scenes: runs, means and paired changes, as data and text.

SCHEMA = "hexapod_pin.comparison"
SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Comparison(Immutable):
    """Runs of several controllers on the same scenes; the first controller is the baseline.

    Attributes:
        runs: of each scene and variant, one run per controller.
        settings: how they were run, one line each.
        assumed: statements of what is assumed rather than taken from a source.
        motor: what drives the joints, as text.
        contact: laws of the feet on the ground, as text.
    """

    runs: tuple[ComparedRun, ...]
    settings: tuple[str, ...] = field(default=(), kw_only=True)
    assumed: tuple[str, ...] = field(default=(), kw_only=True)
    motor: str = field(default="", kw_only=True, repr=False)
    contact: str = field(default="", kw_only=True, repr=False)

    def __post_init__(self) -> None:
        """Refuse a comparison of nothing, and two runs in one place."""
        if not self.runs:
            raise ParameterError("Comparison.runs", self.runs, "at least one run")
        object.__setattr__(self, "runs", tuple(self.runs))
        if len(self._by_place) < len(self.runs):
            raise ParameterError(
                "Comparison.runs", len(self.runs), "one per scene, variant and controller"
            )

    @cached_property
    def _by_place(self) -> dict[tuple[str, int, str], ComparedRun]:
        return {(run.scene, run.number, run.controller): run for run in self.runs}

    @property
    def scenes(self) -> tuple[str, ...]:
        """Names of the scenes, in order."""
        return tuple(dict.fromkeys(run.scene for run in self.runs))

    @property
    def controllers(self) -> tuple[str, ...]:
        """Names of the controllers, in order; the first is the baseline."""
        return tuple(dict.fromkeys(run.controller for run in self.runs))

    @property
    def baseline(self) -> str:
        """The controller that the others are compared with."""
        return self.controllers[0]

    def of(self, scene: str, controller: str) -> tuple[ComparedRun, ...]:
        """Return the runs of a controller on all variants of a scene.

        Raises:
            UnknownNameError: there is no such scene or controller.
        """
        require_known("scene", scene, self.scenes)
        require_known("controller", controller, self.controllers)
        return tuple(r for r in self.runs if r.scene == scene and r.controller == controller)

    def mean(self, scene: str, controller: str, metric: str) -> Estimate | None:
        """Return the mean over the variants of a scene that were walked; None where none was.

        Raises:
            UnknownNameError: there is no such scene, controller or metric.
        """
        found = [_number(run, metric) for run in self.of(scene, controller)]
        return mean_estimate([value for value in found if value is not None])

    def change(self, scene: str, controller: str, metric: str) -> Estimate | None:
        """Return the relative change to the baseline, over variants that both walked.

        0.1 is 10 % more than the baseline. None of the baseline itself, where no pair walked, and
        where the baseline's mean is 0.

        Raises:
            UnknownNameError: there is no such scene, controller or metric.
        """
        runs = self.of(scene, controller)
        if controller == self.baseline:
            return None
        pairs = []
        for run in runs:
            other = self._by_place.get((scene, run.number, self.baseline))
            mine = _number(run, metric)
            base = None if other is None else _number(other, metric)
            if mine is not None and base is not None:
                pairs.append((mine, base))
        return relative_change([mine for mine, _ in pairs], [base for _, base in pairs])

    @property
    def finished(self) -> bool:
        """Whether every run was run."""
        return all(run.outcome is not Outcome.NOT_RUN for run in self.runs)

    @property
    def data(self) -> dict[str, Any]:
        """All runs, means and changes as JSON-able data, with units and meanings."""
        return {
            "schema": SCHEMA,
            "schema_version": SCHEMA_VERSION,
            "baseline": self.baseline,
            "confidence": CONFIDENCE,
            "metrics": {
                name: {"unit": one.unit, "meaning": one.meaning} for name, one in METRICS.items()
            },
            "runs": [run.to_dict() for run in self.runs],
            "means": self._estimates(self.mean),
            "changes": self._estimates(self.change),
            "settings": list(self.settings),
            "assumed": list(self.assumed),
        }

    def _estimates(self, of: Any) -> dict[str, Any]:
        """Return an estimate of each scene, controller and metric as data."""

        def plain(found: Estimate | None) -> dict[str, Any] | None:
            return None if found is None else found.to_dict()

        return {
            scene: {
                controller: {name: plain(of(scene, controller, name)) for name in METRICS}
                for controller in self.controllers
            }
            for scene in self.scenes
        }

    def to_json(self) -> str:
        """Return `data` as JSON text."""
        return json.dumps(self.data, indent=2, allow_nan=False)

    def save(self, path: str | Path) -> Path:
        """Write `data` as a JSON file, wholly or not at all, and return its path.

        Raises:
            TraceFileError: the file cannot be written.
        """
        check_ending(path, JSON)
        return write_atomically(path, self.to_json().encode())

    def lines(self) -> list[str]:
        """Return what a user decides by: who is ahead, and a row for each scene and controller."""
        return answer_lines(self)

    def table(self) -> str:
        """Return plain text: a table per scene with units, intervals and changes."""
        return text_table(self)

    def to_markdown(self) -> str:
        """Return the same tables in Markdown."""
        return markdown_table(self)


def _number(run: ComparedRun, metric: str) -> float | None:
    """Return a number of a run; None where it has none.

    Raises:
        UnknownNameError: there is no such metric.
    """
    require_known("metric", metric, METRICS)
    return None if run.metrics is None else getattr(run.metrics, metric)
