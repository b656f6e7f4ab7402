"""An objective rates runs against a baseline; a tuning result holds all candidates and the gain."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.summary import Summary
from hexapod_pin.text_table import Cell, Table


@dataclass(frozen=True)
class Candidate:
    """One set of parameters that was tried.

    Attributes:
        values: of the parameters, by name.
        score: of the objective; the penalty where a run failed.
        failure: error of the first run that failed; empty if none did.
        generation: 0 for the first.
    """

    values: Mapping[str, float]
    score: float
    failure: str
    generation: int


@dataclass(frozen=True)
class Scores:
    """Scores of baseline, start and best on a set of scenes; less is better.

    Attributes:
        baseline: of the baseline itself.
        start: of the parameters the search began with.
        best: of the best found.
        by_scene: of each scene alone, in this order, by its name.
        failures: what failed in runs of start or best, by scene; those scores are the penalty.
    """

    baseline: float
    start: float
    best: float
    by_scene: Mapping[str, tuple[float, float, float]]
    failures: Mapping[str, str]

    @property
    def gain(self) -> float:
        """Share of the baseline's score that the best is below it; negative where it is worse.

        NaN where the baseline's score is not positive.
        """
        return _gain(self.baseline, self.best)

    @property
    def data(self) -> dict[str, Any]:
        """Numbers for a file."""
        scenes = {name: list(row) for name, row in self.by_scene.items()}
        return {
            "baseline": self.baseline, "start": self.start, "best": self.best, "gain": self.gain,
            "by_scene": scenes, "failures": dict(self.failures),
        }  # fmt: skip


@dataclass(frozen=True)
class TuningResult(Immutable):
    """Parameters that were tuned, with what they are worth.

    Attributes:
        start: the parameters the search began with.
        best: those with the smallest score of all that did not fail, the first of equal ones.
        bounds: of each parameter.
        logarithmic: parameters that were searched on a logarithmic scale.
        tuned: scores on the scenes that were tuned on.
        held_out: scores on the others; None where tuning was interrupted.
        history: candidates in the order in which they were tried, the start first.
        penalty: score of a candidate of which a run fails.
        seed: of the search.
        robot: names of the robots of the scenes tuned on.
        walk: what the baseline walks: its gait or its kind of controller.
    """

    start: Mapping[str, float]
    best: Mapping[str, float]
    bounds: Mapping[str, tuple[float, float]]
    logarithmic: tuple[str, ...]
    tuned: Scores
    held_out: Scores | None
    history: tuple[Candidate, ...]
    penalty: float
    seed: int
    robot: str = ""
    walk: str = ""

    @property
    def failed(self) -> int:
        """How many candidates failed."""
        return sum(bool(one.failure) for one in self.history)

    @property
    def data(self) -> dict[str, Any]:
        """Everything as plain data, for JSON or TOML."""
        held = None if self.held_out is None else self.held_out.data
        return {
            "start": dict(self.start), "best": dict(self.best),
            "bounds": {name: list(pair) for name, pair in self.bounds.items()},
            "logarithmic": list(self.logarithmic), "tuned": self.tuned.data, "held_out": held,
            "penalty": self.penalty, "seed": self.seed, "failed": self.failed,
            "robot": self.robot, "walk": self.walk,
            "history": [
                {"values": dict(one.values), "score": one.score, "failure": one.failure,
                 "generation": one.generation} for one in self.history
            ],
        }  # fmt: skip

    def table(self) -> str:
        """Return parameters and scores as two tables (Markdown)."""
        parameters = []
        for name, value in self.best.items():
            low, high = self.bounds[name]
            scale = ", log" if name in self.logarithmic else ""
            parameters.append((name, self.start[name], value, f"{low:g}..{high:g}{scale}"))
        scores = _rows("tuned on", self.tuned)
        if self.held_out is None:
            scores.append(("held out", "", "", "", "not run: interrupted"))
        else:
            scores += _rows("held out", self.held_out)
        head = ("parameter", "start", "best", "bounds")
        of_parameters = Table("", head, parameters, "<>><", number=".6g")
        of_scores = Table("", ("scenes", "baseline", "start", "best", "gain"), scores, "<>")
        counts = f"{len(self.history)} candidates, {self.failed} failed (score {self.penalty:g})"
        last = f"Less is better. {counts}, seed {self.seed}."
        return "\n".join([of_parameters.markdown(), of_scores.markdown(), last])


def _gain(baseline: float, best: float) -> float:
    return 1.0 - best / baseline if baseline > 0.0 else math.nan


def _rows(label: str, scores: Scores) -> list[tuple[Cell, ...]]:
    """Return the rows of a set of scenes: all together, then each."""
    rows = [_row(f"**{label}**", (scores.baseline, scores.start, scores.best))]
    return rows + [_row(f"{label}: {name}", row) for name, row in scores.by_scene.items()]


def _row(label: str, values: tuple[float, float, float]) -> tuple[Cell, ...]:
    baseline, start, best = values
    gain = _gain(baseline, best)
    text = f"{100.0 * gain:+.1f} %" if math.isfinite(gain) else "-"
    return label, baseline, start, best, text


# Objectives of tuning: what a set of runs is worth against the same runs of a baseline.

Objective = Callable[[Sequence[Summary], Sequence[Summary]], float]
"""Takes the summaries of some scenes and those of the baseline on the same scenes; less is better.

It applies to all scenes together, and to each alone.
"""

Metric = Callable[[Summary], float]


@checked
@dataclass(frozen=True)
class RelativeObjective:
    """Weighted mean of metrics over those of the baseline, then the mean over the scenes.

    The baseline itself scores 1; 0.7 is 30 % less.

    Attributes:
        weights: of each metric, not negative, by name: an attribute of `Summary` or of `metrics`.
            An array counts by its largest size if its name ends with "peak", else by the sum of
            its sizes.
        metrics: more metrics by name, each positive for the baseline.

    Raises:
        ParameterError: no weight, one that is negative or not finite, or an unknown metric.

    Example:
        >>> RelativeObjective({"force_peak": 1.0, "vertical_acceleration_rms": 1.0})
    """

    weights: Mapping[str, float]
    metrics: Mapping[str, Metric] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what cannot be measured."""
        values = list(self.weights.values())
        if not (values and min(values) >= 0.0 and 0.0 < math.fsum(values) < math.inf):
            raise ParameterError(
                "RelativeObjective.weights",
                dict(self.weights),
                "not negative, one of them positive",
            )
        for name in self.weights:
            if name not in self.metrics and name not in Summary.__dataclass_fields__:
                raise ParameterError(
                    "RelativeObjective.weights", name, "an attribute of Summary, or of metrics"
                )

    def __call__(self, found: Sequence[Summary], baseline: Sequence[Summary]) -> float:
        """Return the score.

        Raises:
            ParameterError: a metric of the baseline is not positive and finite.
        """
        total = math.fsum(self.weights.values())
        scores = []
        for run, reference in zip(found, baseline, strict=True):
            parts = [w * self._ratio(name, run, reference) for name, w in self.weights.items()]
            scores.append(math.fsum(parts) / total)
        return math.fsum(scores) / len(scores)

    def value(self, name: str, run: Summary) -> float:
        """Return one metric of a run.

        Raises:
            ParameterError: it is neither one of `metrics` nor an attribute of Summary.
        """
        if name in self.metrics:
            return float(self.metrics[name](run))
        if name not in Summary.__dataclass_fields__:
            allowed = "an attribute of Summary, or of metrics"
            raise ParameterError("RelativeObjective.value.name", name, allowed)
        sizes = np.abs(np.asarray(getattr(run, name), dtype=float))
        return float(sizes.max() if name.endswith("peak") else sizes.sum())

    def _ratio(self, name: str, run: Summary, reference: Summary) -> float:
        over = self.value(name, reference)
        if not (math.isfinite(over) and over > 0.0):
            raise ParameterError(
                f"RelativeObjective.{name}", over, "positive and finite for the baseline"
            )
        return self.value(name, run) / over
