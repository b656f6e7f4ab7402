"""Where a scene switches: error against accuracy, and the observed order, before and after.

Every run is a single one: what is asked for is what its steps may lose, and nothing corrects it.
The exponent is that of error = const tolerance^p, by least squares over the logarithms of errors
above the truth's uncertainty: near 1 where the error follows what a step may lose, near 0 where a
switch is met by chance. The tolerance is the accuracy, held at the method's loosest: accuracies of
one tolerance are one run, which counts once.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from random_scenes.switching import SWITCHING

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.simulation.methods import METHODS, resolve_method
from hexapod_pin.text_table import Table
from hexapod_pin.validation.solver_setting import SolverSetting
from studies.promise.rows import PromiseRun, judge_run
from studies.promise.truth import Truth, find_truth
from studies.study import RESULTS, StudyReport

BEFORE = RESULTS / "promise_orders_before.json"
ACCURACIES = "1e-4,1e-5,1e-6,1e-7,1e-8,1e-9"
ADAPTIVE = "extrapolated-euler,ndf,dop853"

LEAST_EXPONENT = 0.7
"""Exponent from which a method counts as following the tolerance."""

LISTS = ("accuracies", "errors", "tolerances")
"""Entries of a row that are lists in a file."""

SURE = 3.0
"""Errors count from this many times the truth's uncertainty on."""


@dataclass(frozen=True)
class OrderRow:
    """A scene by a method.

    Attributes:
        scene, method: what was run.
        accuracies: asked for [m, rad].
        errors: got [m, rad]; nan where a run did not end.
        uncertainty: of the truth [m, rad].
        tolerances: of a step [m, rad]; empty: the accuracies.
    """

    scene: str
    method: str
    accuracies: tuple[float, ...]
    errors: tuple[float, ...]
    uncertainty: float
    tolerances: tuple[float, ...] = ()

    @property
    def exponent(self) -> float:
        """Observed p of error = const tolerance^p; nan with fewer than three sure errors."""
        sure = {
            lost: error
            for lost, error in zip(self.tolerances or self.accuracies, self.errors, strict=True)
            if error > max(SURE * self.uncertainty, 1e-13)
        }
        if len(sure) < 3:
            return math.nan
        return float(np.polyfit(np.log(list(sure)), np.log(list(sure.values())), 1)[0])

    @property
    def worst(self) -> float:
        """Largest error over accuracy, of those that the truth can judge; nan without any."""
        ratios = [
            error / asked
            for asked, error in zip(self.accuracies, self.errors, strict=True)
            if self.uncertainty <= 0.1 * asked and not math.isnan(error)
        ]
        return max(ratios, default=math.nan)

    @property
    def converges(self) -> bool:
        """Whether the error follows the accuracy, or is within it throughout."""
        return self.exponent >= LEAST_EXPONENT or not self.worst > 1.0

    @property
    def text(self) -> str:
        """Exponent and largest error over accuracy."""
        shown = "-" if math.isnan(self.exponent) else f"{self.exponent:.2f}"
        return f"{shown} (x{self.worst:.3g})"


def promise_orders(
    *, methods: str = ADAPTIVE, accuracies: str = ACCURACIES, scenes: str = "", record: str = "",
    before: str = str(BEFORE),
) -> StudyReport:  # fmt: skip
    """Error against accuracy on every scene that switches, before and after.

    `--scenes "part of a name"` chooses; `--record F` writes the rows as what it was before.
    """
    asked = [float(word) for word in accuracies.split(",")]
    rows: list[OrderRow] = []
    for name in (name for name in SWITCHING if scenes in name):
        scene = SWITCHING[name]()
        truth = find_truth(scene, min(asked))
        for method in methods.split(","):
            own = METHODS[method]
            settings = [
                SolverSetting(method, value)
                for value in asked
                if own.tightest <= value <= own.loosest
            ]
            runs = [judge_run(scene, truth, setting) for setting in settings]
            rows.append(_row(name, method, runs, truth))
    data = {"rows": [asdict(row) for row in rows]}
    if record:
        write_atomically(record, json.dumps(data, indent=1) + "\n")
    met = all(row.converges for row in rows)
    return StudyReport("Orders where a scene switches", _parts(rows, asked, before), data, met)


def _row(name: str, method: str, runs: Sequence[PromiseRun], truth: Truth) -> OrderRow:
    asked, errors = (tuple(getattr(run, one) for run in runs) for one in ("accuracy", "error"))
    tolerances = tuple(resolve_method(method, one, None).tolerance for one in asked)
    return OrderRow(name, method, asked, errors, truth.uncertainty, tolerances)


def _parts(rows: Sequence[OrderRow], asked: Sequence[float], before: str) -> list[str | Table]:
    known = _read(Path(before))
    lines, errors = [], []
    for row in rows:
        old = known.get((row.scene, row.method))
        verdict = "PASS" if row.converges else "FAIL"
        lines.append((row.scene, row.method, "-" if old is None else old.text, row.text, verdict))
        got = dict(zip(row.accuracies, row.errors, strict=True))
        cells = [f"{got[one]:.1e}" if one in got else "-" for one in asked]
        errors.append((row.scene, row.method, *cells, f"{row.uncertainty:.0e}"))
    head = (
        "scene",
        "method",
        "before",
        "after",
        f"converges: exponent from {LEAST_EXPONENT:g}, or within",
    )
    error_head = ("scene", "method", *(f"{one:.0e}" for one in asked), "truth's uncertainty")
    return [
        "Exponent of the error in what a step may lose (the accuracy, held at the method's "
        "loosest; in brackets the largest error over accuracy), of single runs, before and after. "
        "1: the error follows it.",
        Table("Observed exponent", head, lines),
        Table("Error [m, rad] by accuracy asked for", error_head, errors),
    ]


def _read(path: Path) -> Mapping[tuple[str, str], OrderRow]:
    """Return what was recorded before, by scene and method; nothing where there is no file."""
    if not path.exists():
        return {}
    data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    rows = [
        OrderRow(**{**row, **{k: tuple(row.get(k, ())) for k in LISTS}}) for row in data["rows"]
    ]
    return {(row.scene, row.method): row for row in rows}
