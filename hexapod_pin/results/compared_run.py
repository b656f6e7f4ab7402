"""One run of a comparison: what became of it, and its numbers where it walked."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from hexapod_pin.errors import DivergenceError, HexapodError, ParameterError
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.walk_metrics import WalkMetrics

TILT_LIMIT_RAD = np.pi / 3.0
"""Roll or pitch from which a robot has fallen [rad], *assumed*."""


class Outcome(str, Enum):
    """What became of a run."""

    WALKED = "walked"
    FELL = "fell"
    TOO_SHORT = "too short"
    DIVERGED = "diverged"
    REFUSED = "refused"
    FAILED = "failed"
    NOT_RUN = "not run"


@dataclass(frozen=True)
class ComparedRun:
    """One controller on one scene.

    Attributes:
        scene: name of the scene.
        number: which of the scene's variants (terrain seeds), from 0.
        controller: name of the controller.
        outcome: what became of it. A run "fell" when the trunk touched the ground, or when roll or
            pitch exceeded 60 degrees (*assumed*).
        reason: why it has no numbers; empty where it walked.
        metrics: its numbers; None unless it walked.
        summary: what it gathered, fallen or not; None where it did not end.
    """

    scene: str
    number: int
    controller: str
    outcome: Outcome
    reason: str = ""
    metrics: WalkMetrics | None = None
    summary: Summary | None = field(default=None, repr=False, compare=False)

    @classmethod
    def of(
        cls,
        scene: str,
        number: int,
        controller: str,
        result: Summary | Exception | None,
        *,
        turn_rate: float | None = None,
    ) -> ComparedRun:
        """Judge what a run came to; None: it was not run. `turn_rate`: as of `WalkMetrics.of`."""
        place = (scene, number, controller)
        if result is None:
            return cls(*place, Outcome.NOT_RUN, "interrupted before its turn")
        if isinstance(result, Exception):
            return cls(*place, _outcome_of(result), _text(result))
        fall = fall_of(result)
        if fall:
            return cls(*place, Outcome.FELL, fall, summary=result)
        try:
            metrics = WalkMetrics.of(result, turn_rate=turn_rate)
        except ParameterError as error:
            return cls(*place, Outcome.TOO_SHORT, str(error), summary=result)
        return cls(*place, Outcome.WALKED, metrics=metrics, summary=result)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; numbers None unless the run walked."""
        return {
            "scene": self.scene,
            "number": self.number,
            "controller": self.controller,
            "outcome": self.outcome.value,
            "reason": self.reason,
            "metrics": None if self.metrics is None else self.metrics.to_dict(),
        }


def fall_of(summary: Summary) -> str:
    """Return when and how a robot fell, in words; empty where it did not."""
    for event in summary.events:
        if event.kind == "trunk-contact":
            return f"the trunk touched the ground with {event.what} at {event.time:.4g} s"
    for name in ("roll", "pitch"):
        angle = abs(getattr(summary, f"{name}_peak"))
        if angle > TILT_LIMIT_RAD:
            return f"{name} of {np.degrees(angle):.3g} degrees"
    return ""


def _outcome_of(error: Exception) -> Outcome:
    if isinstance(error, DivergenceError):
        return Outcome.DIVERGED
    return Outcome.REFUSED if isinstance(error, HexapodError) else Outcome.FAILED


def _text(error: Exception) -> str:
    return str(error) if isinstance(error, HexapodError) else f"{type(error).__name__}: {error}"
