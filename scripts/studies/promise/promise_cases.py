"""Where a stated accuracy was found not to be kept: each place measured, before and after.

What it was before stands in `promise_cases_before.json`, measured by this study (`--record`) with
the methods as they were when the places were reported.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from random_scenes.named_cases import CASES, NamedCase

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.text_table import Table
from hexapod_pin.validation.solver_setting import SolverSetting
from studies.promise.forces import force_rows, force_table
from studies.promise.rows import PromiseRun, SceneResult, judge_scene
from studies.promise.runner import run_scenes
from studies.study import RESULTS, StudyReport

BEFORE = RESULTS / "promise_cases_before.json"


@dataclass(frozen=True)
class CaseRow:
    """A case by a method at an accuracy, over its scenes.

    Attributes:
        case, method, accuracy: what was run.
        runs: how many.
        unjudged: of which the truth is not sure enough.
        error_reported: that reported a larger error.
        median, worst: error over accuracy, of judged runs that reported no larger error, or of all
            where none is left.
        error: the largest of those errors [m, rad].
        least_estimate: least estimate over error.
        below: estimates below the error.
        uncertainty: of the truths, the largest [m, rad].
    """

    case: str
    method: str
    accuracy: float
    runs: int
    unjudged: int
    error_reported: int
    median: float
    worst: float
    error: float
    least_estimate: float
    below: int
    uncertainty: float

    @property
    def missed(self) -> bool:
        """Whether a run missed the accuracy and did not say so."""
        return self.worst > 1.0 and self.error_reported < self.runs

    @property
    def verdict(self) -> str:
        """The verdict in plain words."""
        if self.missed:
            return "FAIL"
        if self.error_reported == self.runs:
            return "said that it could not"
        return "not known" if self.unjudged == self.runs else "kept"

    @property
    def text(self) -> str:
        """Error over accuracy and estimate over error, in a cell."""
        if self.unjudged == self.runs:
            return f"no truth ({self.uncertainty:.0e})"
        said = (
            f", {self.error_reported} of {self.runs} error reported" if self.error_reported else ""
        )
        partly = f", {self.unjudged} not judged" if self.unjudged else ""
        return f"x{self.worst:.3g} ({self.least_estimate:.2g}){said}{partly}"


def case_row(case: str, runs: Sequence[PromiseRun]) -> CaseRow:
    """Return what the runs of a case by one setting come to."""
    judged = [run for run in runs if run.judged and not math.isnan(run.error)]
    own = [run for run in judged if run.counted] or judged
    ratios = sorted(run.ratio for run in own)
    return CaseRow(
        case, runs[0].method, runs[0].accuracy, len(runs), sum(not run.judged for run in runs),
        sum(run.error_reported for run in runs), ratios[len(ratios) // 2] if own else math.nan,
        ratios[-1] if own else math.nan, max((run.error for run in own), default=math.nan),
        min((run.overestimate for run in own), default=math.nan),
        sum(not run.covered for run in own), max(run.uncertainty for run in runs),
    )  # fmt: skip


@dataclass(frozen=True)
class JudgeNamed:
    """Judges the scene of a key "case/scene number"."""

    def __call__(self, key: str) -> SceneResult:
        """Return the result of a key."""
        name, index = _split(key)
        case = next(case for case in CASES if case.name == name)
        settings = [SolverSetting(*one, kept=True) for one in case.settings]
        return judge_scene(key, case.scenes()[index], settings)


def _split(key: str) -> tuple[str, int]:
    name, index = key.rsplit("/", 1)
    return name, int(index)


def promise_cases(
    *, file: str = "", processes: int = 1, record: str = "", before: str = str(BEFORE),
    cases: str = "", forces: float = 5.0, only: int = -1,
) -> StudyReport:  # fmt: skip
    """The places where an accuracy was found not to be kept, before and after.

    `--file` keeps finished scenes and goes on; `--record F` writes the rows to F as what it was
    before; `--cases "part of a name"` and `--only SCENE` choose; `--forces S` seconds of walk.
    """
    chosen = [case for case in CASES if cases in case.name]
    keys = [
        f"{case.name}/{index}"
        for case in chosen
        for index in range(len(case.scenes()))
        if only in (-1, index)
    ]
    path = Path(file) if file else None
    results, whole = run_scenes(keys, JudgeNamed(), path=path, processes=processes)
    rows = [row for case in chosen for row in _rows_of(case, results)]
    felt = force_rows(forces)
    data = {"rows": [asdict(row) for row in rows], "forces": [asdict(row) for row in felt]}
    if record:
        write_atomically(record, json.dumps(data, indent=1) + "\n")
    known = _read(Path(before))
    parts: list[str | Table] = [
        "A cell holds the largest error over accuracy of the case's scenes (in brackets the least "
        "estimate over error), before and after. Runs that said that they could not keep the "
        "accuracy are counted, and left out of the largest unless all did.",
        _table(rows, known),
        force_table(felt, known),
        _unsure(results),
    ]
    kept = not any(row.missed for row in rows)
    return StudyReport("Places where accuracies were missed", parts, data, met=kept and whole)


def _rows_of(case: NamedCase, results: Sequence[SceneResult]) -> list[CaseRow]:
    own = [result for result in results if _split(result.key)[0] == case.name]
    columns = zip(*(result.runs for result in own), strict=True)
    return [case_row(case.name, runs) for runs in columns]


def _read(path: Path) -> Mapping[str, Any]:
    """Return what was recorded before; nothing where there is no file."""
    if not path.exists():
        return {"rows": [], "forces": []}
    data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return data


def _table(rows: Sequence[CaseRow], before: Mapping[str, Any]) -> Table:
    known = {
        (row.case, row.method, row.accuracy): row
        for row in (CaseRow(**data) for data in before["rows"])
    }
    reported = {case.name: case.reported for case in CASES}
    lines = []
    for row in rows:
        old = known.get((row.case, row.method, row.accuracy))
        lines.append((
            row.case, reported[row.case], row.method, f"{row.accuracy:.0e}",
            "-" if old is None else old.text, row.text, row.verdict,
        ))  # fmt: skip
    head = ("case", "reported", "method", "accuracy", "before", "after", "verdict")
    return Table("Error over accuracy (estimate over error)", head, lines)


def _unsure(results: Sequence[SceneResult]) -> Table:
    rows = [
        (result.name, f"{result.uncertainty:.1e}", result.truth, "; ".join(result.notes))
        for result in results
        if not all(run.judged for run in result.runs)
    ]
    head = ("case/scene", "references apart [m, rad]", "truth and check", "attempts")
    return Table("Scenes without a truth, or none for the tightest", head, rows)
