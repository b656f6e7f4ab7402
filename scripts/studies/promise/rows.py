"""What one scene of the study of accuracy gave: its truth, its runs, and the verdict on each."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from random_scenes import PromiseScene

from hexapod_pin.errors import HexapodError, SimulationInterrupted
from hexapod_pin.simulation.methods import METHODS
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import SolverSetting
from studies.promise.truth import Truth, find_truth

ERROR_FLOOR = 1e-12
"""Errors below this are round-off [m, rad]."""

SURE = 3.0
"""A truth that is not sure to a tenth of the accuracy still tells which side of it an error is on
where they are apart by so many times its uncertainty."""

BEYOND = 3.0
"""Errors over accuracy that no run may exceed unless it says so."""


@dataclass(frozen=True)
class PromiseRun:
    """One run, held against the truth.

    Attributes:
        method: its name.
        accuracy: asked for [m, rad].
        error: largest difference of any position at any sample from the truth [m, rad]; nan
            where the run did not end or there is no truth.
        estimate: what the run says of its own error [m, rad]; nan where it did not end.
        error_reported: whether the run itself said that it could not: a typed error, or
            `Trace.accuracy_kept` False.
        refusal: the typed error; "" where it ended.
        uncertainty: of the truth [m, rad].
        evaluations: what it cost [-].
        seconds: wall time.
    """

    method: str
    accuracy: float
    error: float
    estimate: float
    error_reported: bool
    refusal: str
    uncertainty: float
    evaluations: int
    seconds: float

    @property
    def ratio(self) -> float:
        """Error over the accuracy asked for; inf where there is none."""
        return math.inf if math.isnan(self.error) else self.error / self.accuracy

    @property
    def judged(self) -> bool:
        """Whether the truth is sure enough: to a tenth of the accuracy, or for this error."""
        if self.uncertainty <= 0.1 * self.accuracy:
            return True
        apart = abs(self.error - self.accuracy)
        return not math.isnan(apart) and apart > SURE * self.uncertainty

    @property
    def counted(self) -> bool:
        """Whether the promise applies: the truth is sure, and the run did not say it could not."""
        return self.judged and not self.error_reported

    @property
    def covered(self) -> bool:
        """Whether the estimate is at least the error, as far as the truth is sure."""
        sure = self.error - self.uncertainty
        return sure <= ERROR_FLOOR or self.estimate >= sure

    @property
    def overestimate(self) -> float:
        """Estimate over error; over the truth's uncertainty where that is larger."""
        return self.estimate / max(self.error, self.uncertainty, ERROR_FLOOR)


@dataclass(frozen=True)
class SceneResult:
    """A scene with its runs; `key` tells it from all others of the study."""

    key: str
    labels: Mapping[str, str]
    duration: float
    truth: str
    uncertainty: float
    truth_seconds: float
    notes: Sequence[str]
    runs: tuple[PromiseRun, ...]

    @property
    def name(self) -> str:
        """The key and what the scene is made of."""
        parts = self.labels
        laws = f"{parts['normal']} + {parts['friction']}"
        return (
            f"{self.key}: {parts['kind']}, {parts['robot']}, {laws}, {parts['terrain']}, "
            f"{parts['drive']}"
        )

    @property
    def has_truth(self) -> bool:
        """Whether at least one accuracy could be judged."""
        return any(run.judged for run in self.runs)

    def to_json(self) -> str:
        """Return one line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, line: str) -> SceneResult:
        """Read what `to_json` wrote."""
        data: dict[str, Any] = json.loads(line)
        data["runs"] = tuple(PromiseRun(**run) for run in data["runs"])
        data["notes"] = tuple(data["notes"])
        return cls(**data)


def settings_of(methods: Sequence[str], accuracies: Sequence[float]) -> list[SolverSetting]:
    """Return every method at every accuracy that it may be asked for."""
    return [
        SolverSetting(method, accuracy, kept=True)
        for method in methods
        for accuracy in accuracies
        if METHODS[method].tightest <= accuracy <= METHODS[method].loosest
    ]


def judge_scene(
    key: str, scene: PromiseScene, settings: Sequence[SolverSetting], truth: Truth | None = None
) -> SceneResult:
    """Find the truth of a scene, run it at every setting, and hold each run against the truth.

    Args:
        key: what tells the scene from the others.
        scene: the scene.
        settings: adaptive methods with their accuracies.
        truth: known already; None: looked for.
    """
    known = find_truth(scene, min(one.value for one in settings)) if truth is None else truth
    runs = tuple(judge_run(scene, known, setting) for setting in settings)
    return SceneResult(
        key, scene.labels.to_dict(), scene.duration, f"{known.method}; {known.check}",
        known.uncertainty, known.seconds, known.notes, runs,
    )  # fmt: skip


def judge_run(scene: PromiseScene, truth: Truth, setting: SolverSetting) -> PromiseRun:
    """Run a scene at a setting and hold it against the truth."""
    begin = time.perf_counter()
    error = estimate = math.nan
    refusal, error_reported, evaluations = "", True, 0
    try:
        trace = scene.run(**setting.arguments)
    except SimulationInterrupted:
        raise
    except HexapodError as fault:
        refusal = f"{type(fault).__name__}: {fault}"[:160]
    else:
        estimate, error_reported = trace.error_estimate, setting.kept and not trace.accuracy_kept
        counters = trace.counters
        own = counters["evaluations"]
        evaluations = int(counters.get("evaluations_of_all_runs", own))
        if truth.q is not None:
            error = PositionError.between(trace.q, truth.q).q
    return PromiseRun(
        setting.method, setting.value, error, estimate, error_reported, refusal, truth.uncertainty,
        evaluations, time.perf_counter() - begin,
    )  # fmt: skip
