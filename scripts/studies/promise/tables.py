"""Summaries of the study of accuracy: what was kept, what was said, what was not judged."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hexapod_pin.text_table import Table
from studies.promise.rows import BEYOND, PromiseRun, SceneResult

LEAST_SHARE, MOST_OVERESTIMATE = 0.99, 3.0
"""Promised: share of runs within the accuracy, and of estimates at least the error; median of
estimate over error."""

HEAD = (
    "", "runs", "within", f"within {BEYOND:g}x", "error over accuracy, median", "most",
    "estimate >= error", "estimate over error, median", "error reported", "not judged",
)  # fmt: skip


@dataclass(frozen=True)
class Shares:
    """Counts over runs: those that the promise applies to, and the others."""

    runs: Sequence[PromiseRun]

    @property
    def counted(self) -> list[PromiseRun]:
        """The runs that the promise applies to."""
        return [run for run in self.runs if run.counted]

    @property
    def error_reported(self) -> list[PromiseRun]:
        """The runs that said they could not, of those that can be judged."""
        return [run for run in self.runs if run.judged and run.error_reported]

    @property
    def needless(self) -> int:
        """How many of those were within the accuracy all the same."""
        return sum(run.ratio <= 1.0 for run in self.error_reported)

    @property
    def estimated(self) -> list[PromiseRun]:
        """The runs that ended with an estimate, whatever they said, where the truth is sure."""
        ended = [run for run in self.runs if not math.isnan(run.estimate + run.error)]
        return [run for run in ended if run.judged]

    @property
    def within(self) -> float:
        """Share within the accuracy."""
        return _share(self.counted, lambda run: run.ratio <= 1.0)

    @property
    def within_beyond(self) -> float:
        """Share within `BEYOND` times the accuracy."""
        return _share(self.counted, lambda run: run.ratio <= BEYOND)

    @property
    def covered(self) -> float:
        """Share of estimates at least the error."""
        return _share(self.estimated, lambda run: run.covered)

    @property
    def overestimate(self) -> float:
        """Median of estimate over error."""
        return _median([run.overestimate for run in self.estimated])

    @property
    def kept(self) -> bool:
        """Whether the whole promise is kept."""
        return (
            self.within >= LEAST_SHARE
            and self.within_beyond == 1.0
            and self.covered >= LEAST_SHARE
            and self.overestimate <= MOST_OVERESTIMATE
        )

    def cells(self, name: str) -> tuple[str, ...]:
        """Return a row of a table under `HEAD`."""
        ratios = [run.ratio for run in self.counted]
        return (
            name, str(len(ratios)), _percent(self.within), _percent(self.within_beyond),
            f"{_median(ratios):.2g}", f"{max(ratios, default=math.nan):.3g}",
            _percent(self.covered), f"{self.overestimate:.2g}", str(len(self.error_reported)),
            str(sum(not run.judged for run in self.runs)),
        )  # fmt: skip


def all_runs(results: Sequence[SceneResult]) -> list[PromiseRun]:
    """Return the runs of all scenes."""
    return [run for result in results for run in result.runs]


def summary_tables(results: Sequence[SceneResult]) -> list[Table]:
    """Return the tables by method and accuracy, kind, laws, terrain, robot, drive."""
    runs = all_runs(results)
    settings = dict.fromkeys((run.method, run.accuracy) for run in runs)
    by_setting = [
        Shares([run for run in runs if (run.method, run.accuracy) == one]).cells(
            f"{one[0]} {one[1]:.0e}"
        )
        for one in settings
    ]
    whole = [Shares(runs).cells("all")]
    tables = [Table("By method and accuracy", HEAD, [*whole, *by_setting])]
    for label in ("kind", "normal", "friction", "terrain", "robot", "drive"):
        names = sorted({result.labels[label] for result in results})
        rows = [
            Shares(all_runs([r for r in results if r.labels[label] == name])).cells(name)
            for name in names
        ]
        tables.append(Table(f"By {label}", HEAD, rows))
    return tables


def violations(results: Sequence[SceneResult]) -> Table:
    """Return every run that missed its accuracy and did not say so, by scene, the worst first."""
    found: dict[tuple[str, str], list[PromiseRun]] = {}
    for result in results:
        for run in result.runs:
            if run.counted and run.ratio > 1.0:
                found.setdefault((result.name, run.method), []).append(run)
    rows = [
        (
            name, method, ", ".join(f"{run.accuracy:.0e} x{run.ratio:.3g}" for run in runs),
            f"{min(run.overestimate for run in runs):.2g}",
        )
        for (name, method), runs in sorted(
            found.items(), key=lambda item: -max(run.ratio for run in item[1])
        )
    ]  # fmt: skip
    head = ("scene", "method", "accuracy and error over it", "estimate over error, least")
    return Table("Missed without a word", head, rows)


def without_truth(results: Sequence[SceneResult]) -> Table:
    """Return the scenes of which at least one accuracy could not be judged."""
    rows = [
        (
            result.name, "none" if not result.has_truth else "partly",
            f"{result.uncertainty:.1e}", "; ".join(result.notes),
        )
        for result in results
        if not all(run.judged for run in result.runs)
    ]  # fmt: skip
    head = ("scene", "judged", "references apart [m, rad]", "attempts")
    return Table("No truth, or none for the tightest", head, rows)


def verdict(results: Sequence[SceneResult]) -> tuple[str, bool]:
    """Return the promise and whether it is kept, in plain words."""
    shares = Shares(all_runs(results))
    checks = (
        (f"within the accuracy in {_percent(LEAST_SHARE)}", _percent(shares.within),
         shares.within >= LEAST_SHARE),
        (f"never beyond {BEYOND:g} times it unless the run reported it",
         f"{_percent(shares.within_beyond)} within", shares.within_beyond == 1.0),
        (f"estimate at least the error in {_percent(LEAST_SHARE)}", _percent(shares.covered),
         shares.covered >= LEAST_SHARE),
        (f"estimate over error at most {MOST_OVERESTIMATE:g} in the median",
         f"{shares.overestimate:.2g}", shares.overestimate <= MOST_OVERESTIMATE),
    )  # fmt: skip
    lines = [f"- {'PASS' if good else 'FAIL'}: {what}: {found}." for what, found, good in checks]
    said, judged = len(shares.error_reported), len(shares.error_reported) + len(shares.counted)
    unjudged = len(shares.runs) - judged
    lines.append(
        f"- {said} of {judged} runs said that they could not keep the accuracy, {shares.needless} "
        f"of them needlessly; {unjudged} more were not judged, for the truth is not sure enough."
    )
    return "\n".join(lines), shares.kept


def _share(runs: Sequence[PromiseRun], holds: Callable[[PromiseRun], bool]) -> float:
    """Return the share of runs for which something holds; nan without any."""
    return sum(map(holds, runs)) / len(runs) if runs else math.nan


def _median(values: Sequence[float]) -> float:
    return statistics.median(values) if values else math.nan


def _percent(share: float) -> str:
    return "-" if math.isnan(share) else f"{100.0 * share:.4g} %"
