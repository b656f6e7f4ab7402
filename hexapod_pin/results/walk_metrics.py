"""What became of a run, and its numbers by which walks are compared.

Repeated runs give means and paired changes with confidence intervals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from hexapod_pin.errors import DivergenceError, HexapodError, ParameterError
from hexapod_pin.results.schema import Record, quantity, schema
from hexapod_pin.results.summary import Summary, path_error
from hexapod_pin.results.torque_budget import TorqueBudget, torque_budget
from hexapod_pin.text_table import labelled


class WalkMetrics(Record):
    """One walk in the numbers by which controllers are compared.

    Over the whole cycles of the summary's window; peaks are those of all accepted steps. None
    stands for what a run does not have: path and cycles where nothing repeats, energies per metre
    where it makes no progress. Energies are mechanical, at the joints.

    The sum of the normal impulses of all feet on level ground is weight times cycle time. The
    planned path goes through the place of the centre of mass at the first edge of a cycle: the
    line of planned heading, or the arc of a turning gait.
    """

    # fmt: off
    slip_distance: float | None = quantity("", "m", "slip path of all feet per cycle")
    slip_per_metre: float | None = quantity("", "m/m", "slip path of all feet per metre travelled")
    friction_work_per_metre: float | None = quantity("", "J/m",
        "friction work of all feet per metre travelled")
    height_rms: float | None = quantity("", "m", "trunk height, RMS about its mean")
    heave_rms: float | None = quantity("", "m", "trunk height, RMS about its straight line in time")
    roll_rms: float | None = quantity("", "rad", "roll, RMS")
    pitch_rms: float | None = quantity("", "rad", "pitch, RMS")
    roll_rate_rms: float | None = quantity("", "rad/s",
        "trunk angular velocity about its x axis, RMS")
    pitch_rate_rms: float | None = quantity("", "rad/s",
        "trunk angular velocity about its y axis, RMS")
    vertical_acceleration_rms: float | None = quantity("", "m/s^2",
        "trunk vertical acceleration, RMS")
    force_peak: float | None = quantity("", "N", "largest normal force of a foot")
    normal_impulse: float | None = quantity("", "N s",
        "normal impulse per cycle of the foot with the largest")
    torque_rms: float | None = quantity("", "N m", "joint torque, RMS over all joints and time")
    torque_peak: float | None = quantity("", "N m", "largest joint torque")
    energy_per_metre: float | None = quantity("", "J/m",
        "absolute mechanical energy per metre travelled")
    positive_energy_per_metre: float | None = quantity("", "J/m",
        "positive mechanical energy per metre travelled")
    cost_of_transport: float | None = quantity("", "1", "absolute energy / (weight x distance)")
    cost_of_transport_positive: float | None = quantity("", "1",
        "positive energy / (weight x distance)")
    measured_speed: float | None = quantity("", "m/s", "speed along the heading")
    path_deviation: float | None = quantity("", "m",
        "lateral distance from the planned path, RMS")
    heading_error: float | None = quantity("", "rad", "size of the yaw error at the end")
    # fmt: on

    @classmethod
    def of(cls, summary: Summary, *, turn_rate: float | None = None) -> WalkMetrics:
        """Read the numbers from the summary of a run.

        Args:
            summary: of a run with at least one whole cycle.
            turn_rate: planned yaw rate [rad/s]; None: that of the gait in the summary's
                controller, 0 where it has none.

        Raises:
            ParameterError: the run is too short for one whole cycle; the error names the
                duration needed.
        """
        budget = torque_budget(summary)
        planned = summary.run.walk.turn_rate if turn_rate is None else turn_rate
        found = {**_feet(summary, budget), **_trunk(summary), **_drives(summary, budget)}
        found |= _way(summary, planned)
        return cls(**{name: _finite(found[name]) for name in METRICS})

    def to_dict(self) -> dict[str, float | None]:
        """Return all numbers by name."""
        return {name: getattr(self, name) for name in METRICS}

    def table(self) -> str:
        """Return a plain text table with units."""
        rows = [(m.meaning, getattr(self, name), m.unit) for name, m in METRICS.items()]
        return "\n".join(labelled(rows))


METRICS = schema(WalkMetrics)
"""Unit and meaning of every number by its name, in the order of tables."""


def _feet(summary: Summary, budget: TorqueBudget) -> dict[str, float | None]:
    slip = float(summary.slip_distance.sum())
    return {
        "slip_distance": slip,
        "slip_per_metre": _per_distance(slip, budget),
        "friction_work_per_metre": _per_distance(float(summary.friction_work.sum()), budget),
        "force_peak": _largest(summary.force_peak),
        "normal_impulse": _largest(summary.normal_impulse),
    }


def _trunk(summary: Summary) -> dict[str, float | None]:
    names = ("height_rms", "heave_rms", "roll_rms", "pitch_rms", "roll_rate_rms", "pitch_rate_rms")
    return {name: getattr(summary, name) for name in (*names, "vertical_acceleration_rms")}


def _drives(summary: Summary, budget: TorqueBudget) -> dict[str, float | None]:
    return {
        "torque_rms": float(np.sqrt(np.mean(summary.torque_rms**2))),
        "torque_peak": _largest(summary.torque_peak),
        "energy_per_metre": _per_distance(budget.absolute_energy, budget),
        "positive_energy_per_metre": _per_distance(budget.positive_energy, budget),
        "cost_of_transport": budget.cost_of_transport,
        "cost_of_transport_positive": budget.cost_of_transport_positive,
    }


def _way(summary: Summary, turn_rate: float) -> dict[str, float | None]:
    if not summary.cycles:
        return {"measured_speed": None, "path_deviation": None, "heading_error": None}
    along, speed = np.array(summary.run.walk.travel_direction), summary.run.walk.speed
    deviation, heading = path_error(
        summary.path[::2], along, first_yaw=summary.first_yaw, speed=speed, turn_rate=turn_rate
    )
    return {
        "measured_speed": summary.measured_speed,
        "path_deviation": deviation,
        "heading_error": abs(heading),
    }


def _per_distance(value: float, budget: TorqueBudget) -> float | None:
    """Return a number per cycle as one per metre; None where the robot does not move forward."""
    return value / budget.distance if budget.makes_way and budget.distance else None


def _largest(values: Any) -> float | None:
    return float(np.max(np.abs(values))) if len(values) else None


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


# One run of a comparison: what became of it, and its numbers where it walked.

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
    """Return when and how a robot fell; empty where it did not."""
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


# Means and paired relative changes of repeated runs, with their confidence intervals.

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Estimate:
    """An estimate with its confidence interval.

    Attributes:
        value: the estimate.
        half_width: half of the interval's width; None of a single run, which has no interval.
        count: number of runs (or pairs of runs) behind it.
    """

    value: float
    half_width: float | None
    count: int

    def to_dict(self) -> dict[str, float | int | None]:
        """Return plain data."""
        return {"value": self.value, "half_width": self.half_width, "count": self.count}

    def differs_from(self, value: float) -> bool:
        """Tell whether the interval excludes a value; False without an interval."""
        return self.half_width is not None and abs(self.value - value) > self.half_width


def mean_estimate(values: Sequence[float]) -> Estimate | None:
    """Return the mean of independent runs; None of no runs.

    The interval is t s / sqrt(n), s with n - 1 degrees of freedom: exact for normal values.
    """
    if not values:
        return None
    return Estimate(float(np.mean(values)), _half_width(np.asarray(values)), len(values))


def relative_change(values: Sequence[float], baseline: Sequence[float]) -> Estimate | None:
    """Return the relative change of the mean, value / baseline - 1, of runs in pairs.

    The ratio estimator with its linearised variance: residuals are (x - r b) / mean(b), r the ratio
    of the means [Cochran1977, section 6.3], so that what a terrain does to both runs of a pair
    cancels. None of no pairs, or of a mean baseline of 0.
    """
    x, b = np.asarray(values, dtype=float), np.asarray(baseline, dtype=float)
    if len(x) == 0 or not (scale := float(np.mean(b))):
        return None
    ratio = float(np.mean(x)) / scale
    residual = (x - ratio * b) / scale
    return Estimate(ratio - 1.0, _half_width(residual), len(x))


def _half_width(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float | None:
    """Return half of the confidence interval of a mean; None of a single value."""
    from scipy.special import stdtrit

    count = len(values)
    if count < 2:
        return None
    quantile = float(stdtrit(count - 1, 0.5 * (1.0 + CONFIDENCE)))
    return quantile * float(np.std(values, ddof=1)) / math.sqrt(count)
