"""Metrics of a walk are read from its summary.

Repeated runs give means and paired changes with confidence intervals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from hexapod_pin.arguments import explain_methods
from hexapod_pin.results.summary import Summary, path_error
from hexapod_pin.results.torque_budget import TorqueBudget, torque_budget
from hexapod_pin.text_table import labelled


class Metric(NamedTuple):
    """Unit and meaning of one number of `WalkMetrics`."""

    unit: str
    meaning: str


METRICS: dict[str, Metric] = {
    "slip_distance": Metric("m", "slip path of all feet per cycle"),
    "slip_per_metre": Metric("m/m", "slip path of all feet per metre travelled"),
    "friction_work_per_metre": Metric("J/m", "friction work of all feet per metre travelled"),
    "height_rms": Metric("m", "trunk height, RMS about its mean"),
    "heave_rms": Metric("m", "trunk height, RMS about its straight line in time"),
    "roll_rms": Metric("rad", "roll, RMS"),
    "pitch_rms": Metric("rad", "pitch, RMS"),
    "roll_rate_rms": Metric("rad/s", "trunk angular velocity about its x axis, RMS"),
    "pitch_rate_rms": Metric("rad/s", "trunk angular velocity about its y axis, RMS"),
    "vertical_acceleration_rms": Metric("m/s^2", "trunk vertical acceleration, RMS"),
    "force_peak": Metric("N", "largest normal force of a foot"),
    "normal_impulse": Metric("N s", "normal impulse per cycle of the foot with the largest"),
    "torque_rms": Metric("N m", "joint torque, RMS over all joints and time"),
    "torque_peak": Metric("N m", "largest joint torque"),
    "energy_per_metre": Metric("J/m", "absolute mechanical energy per metre travelled"),
    "positive_energy_per_metre": Metric("J/m", "positive mechanical energy per metre travelled"),
    "cost_of_transport": Metric("1", "absolute energy / (weight x distance)"),
    "cost_of_transport_positive": Metric("1", "positive energy / (weight x distance)"),
    "measured_speed": Metric("m/s", "speed along the heading"),
    "path_deviation": Metric("m", "lateral distance from the planned path, RMS"),
    "heading_error": Metric("rad", "size of the yaw error at the end"),
}
"""Name: unit and meaning of every number, in the order of tables."""


@explain_methods
@dataclass(frozen=True)
class WalkMetrics:
    """One walk in the numbers by which controllers are compared; units and meanings: `METRICS`.

    Over the whole cycles of the summary's window. None stands for what a run does not have: way
    and cycles where nothing repeats, energies per metre where it makes no way forward, numbers
    that the summary's release did not gather. Energies are mechanical, at the joints.

    Attributes:
        slip_distance: of the contact points on the ground while loaded, all feet, per cycle [m].
        slip_per_metre: the same per metre travelled [m/m].
        friction_work_per_metre: integral of |friction force . slip velocity|, all feet [J/m].
        height_rms: RMS of the trunk's height about its mean [m].
        heave_rms: the same about its straight line in time: without a slope's climb [m].
        roll_rms: RMS roll [rad].
        pitch_rms: RMS pitch [rad].
        roll_rate_rms: RMS of the trunk's angular velocity about its own x axis [rad/s].
        pitch_rate_rms: the same about its own y axis [rad/s].
        vertical_acceleration_rms: of the trunk's origin [m/s^2].
        force_peak: largest normal force on any foot, of all accepted steps [N].
        normal_impulse: of the normal force per cycle, of the foot with the largest [N s]. The sum
            over all feet on level ground is weight times cycle time.
        torque_rms: root of the mean square over all joints and the time [N m].
        torque_peak: largest torque of any joint, of all accepted steps [N m].
        energy_per_metre: integral of |torque * rate| over all joints per metre [J/m].
        positive_energy_per_metre: that of the positive power only [J/m].
        cost_of_transport: absolute energy / (weight * distance) [-].
        cost_of_transport_positive: positive energy / (weight * distance) [-].
        measured_speed: along the heading [m/s].
        path_deviation: RMS lateral distance of the centre of mass, at the edges of the cycles, from
            the planned path through its place at the first edge: the line of planned heading, or
            the arc of a turning gait [m].
        heading_error: |yaw - planned yaw| at the end of the last cycle [rad].
    """

    slip_distance: float | None
    slip_per_metre: float | None
    friction_work_per_metre: float | None
    height_rms: float | None
    heave_rms: float | None
    roll_rms: float | None
    pitch_rms: float | None
    roll_rate_rms: float | None
    pitch_rate_rms: float | None
    vertical_acceleration_rms: float | None
    force_peak: float | None
    normal_impulse: float | None
    torque_rms: float | None
    torque_peak: float | None
    energy_per_metre: float | None
    positive_energy_per_metre: float | None
    cost_of_transport: float | None
    cost_of_transport_positive: float | None
    measured_speed: float | None
    path_deviation: float | None
    heading_error: float | None

    @classmethod
    def of(cls, summary: Summary, *, turn_rate: float | None = None) -> WalkMetrics:
        """Read the numbers from the summary of a run.

        Args:
            summary: of a run with at least one whole cycle.
            turn_rate: planned yaw rate [rad/s]; None: that of the gait in the summary's
                controller, 0 where it has none.

        Raises:
            ParameterError: the run is too short for one whole cycle; says how long it must be.
        """
        budget = torque_budget(summary)
        planned = summary.run.walk.turn_rate if turn_rate is None else turn_rate
        found = {**_feet(summary, budget), **_trunk(summary), **_drives(summary, budget)}
        found |= _way(summary, planned)
        return cls(**{field.name: _finite(found[field.name]) for field in fields(cls)})

    def to_dict(self) -> dict[str, float | None]:
        """Return all numbers by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def table(self) -> str:
        """Return a plain text table with units."""
        rows = [(m.meaning, getattr(self, name), m.unit) for name, m in METRICS.items()]
        return "\n".join(labelled(rows))


def _feet(summary: Summary, budget: TorqueBudget) -> dict[str, float | None]:
    slip = float(summary.slip_distance.sum())
    return {
        "slip_distance": slip,
        "slip_per_metre": _per_way(slip, budget),
        "friction_work_per_metre": _per_way(float(summary.friction_work.sum()), budget),
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
        "energy_per_metre": _per_way(budget.absolute_energy, budget),
        "positive_energy_per_metre": _per_way(budget.positive_energy, budget),
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


def _per_way(value: float, budget: TorqueBudget) -> float | None:
    """Return a number per cycle as one per metre; None where the robot makes no way forward."""
    return value / budget.distance if budget.makes_way and budget.distance else None


def _largest(values: Any) -> float | None:
    return float(np.max(np.abs(values))) if len(values) else None


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


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
