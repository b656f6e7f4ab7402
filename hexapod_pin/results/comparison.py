"""Controllers compared on the same scenes: runs, means and paired changes, as data and text."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.compared_run import ComparedRun, Outcome
from hexapod_pin.results.estimate import CONFIDENCE, Estimate, mean_estimate, relative_change
from hexapod_pin.results.file_ending import JSON, check_ending
from hexapod_pin.results.walk_metrics import METRICS

SCHEMA = "hexapod_pin.comparison"
SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Comparison(Immutable):
    """Runs of several controllers on the same scenes; the first controller is the baseline.

    Attributes:
        runs: of each scene and variant, one run per controller.
        settings: how they were run, in words, one line each.
        assumed: statements of what is assumed rather than taken from a source.
    """

    runs: tuple[ComparedRun, ...]
    settings: tuple[str, ...] = field(default=(), kw_only=True)
    assumed: tuple[str, ...] = field(default=(), kw_only=True)

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
        for kind, name, known in (
            ("scene", scene, self.scenes),
            ("controller", controller, self.controllers),
        ):
            if name not in known:
                raise UnknownNameError(kind, name, list(known))
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
            "metrics": {name: metric._asdict() for name, metric in METRICS.items()},
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

    def table(self) -> str:
        """Return plain text: a table per scene with units, intervals and changes."""
        from hexapod_pin.results.comparison_table import text_table

        return text_table(self)

    def to_markdown(self) -> str:
        """Return the same tables in Markdown."""
        from hexapod_pin.results.comparison_table import markdown_table

        return markdown_table(self)


def _number(run: ComparedRun, metric: str) -> float | None:
    """Return a number of a run; None where it has none.

    Raises:
        UnknownNameError: there is no such metric.
    """
    if metric not in METRICS:
        raise UnknownNameError("metric", metric, list(METRICS))
    return None if run.metrics is None else getattr(run.metrics, metric)
