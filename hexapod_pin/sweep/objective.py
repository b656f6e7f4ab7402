"""Objectives of tuning: what a set of runs is worth against the same runs of a baseline."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.summary import Summary

Objective = Callable[[Sequence[Summary], Sequence[Summary]], float]
"""Takes the summaries of some scenes and those of the baseline on the same scenes; less is better.

It is asked for all scenes together, and for each alone.
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
            raise ParameterError(f"{name} of the baseline", over, "positive and finite")
        return self.value(name, run) / over
