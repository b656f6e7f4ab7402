"""What kept a run from its plan: joints at their limits, feet that slip, drives that lag."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_budget import LIMITED_TORQUE_SHARE
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace

LEAST_TRAVEL = 0.05
"""Way over planned way below which slip per metre says nothing."""


class JointShare(NamedTuple):
    """The joint that was longest at a limit.

    Attributes:
        joint: its name; empty where no joint ever was.
        share: of the time of the whole run [-].
        joints: how many were there at all.
    """

    joint: str
    share: float
    joints: int


class Slip(NamedTuple):
    """Way of the contact points on the ground while loaded, per gait cycle (or window).

    Attributes:
        path: of each foot, by name [m].
        per_metre: the same per metre travelled [m/m]; None where it makes or plans no way.
    """

    path: dict[str, float]
    per_metre: dict[str, float] | None

    @property
    def total(self) -> float | None:
        """Of all feet per metre travelled [m/m]."""
        return None if self.per_metre is None else math.fsum(self.per_metre.values())


NEVER = JointShare("", 0.0, 0)


def at_torque_limit(trace: Trace) -> JointShare:
    """Return the joint that was longest at its torque limit, by accepted steps where known."""
    length = float(trace.time[-1] - trace.time[0])
    if trace.limits and length > 0.0:
        times = np.array([row.limit_time for row in trace.limits])
        return _longest(trace.joint_names, times / length)
    if "torque" not in trace.recorded:
        return NEVER
    limit = np.asarray(trace.meta.get("effort_limit", np.inf), dtype=float)
    return _sampled(trace, np.abs(trace.torque), limit)


def at_speed_limit(trace: Trace) -> JointShare:
    """Return the joint that was longest at or above the velocity limit of its URDF, by samples."""
    limit = np.asarray(trace.meta.get("velocity_limit", np.inf), dtype=float)
    return _sampled(trace, np.abs(trace.v[:, 6:]), limit)


def slip_of(trace: Trace, planned_speed: float) -> Slip | None:
    """Return the slip of a run; None of one that did not gather it.

    Args:
        trace: of the run.
        planned_speed: [m/s].
    """
    try:
        summary = trace.summary
    except ParameterError:
        return None
    if not np.isfinite(summary.slip_path).all():
        return None
    path = dict(zip(summary.foot_names, summary.slip_path.tolist(), strict=True))
    way, planned = _way(summary), planned_speed * summary.time / (summary.cycles or 1)
    if planned <= 0.0 or way is None or way <= LEAST_TRAVEL * planned:
        return Slip(path, None)
    return Slip(path, {name: value / way for name, value in path.items()})


def lag(trace: Trace) -> JointShare:
    """Return the joint with the largest RMS distance from its set-point, as `share` [rad or m]."""
    if "set_points" not in trace.recorded:
        return NEVER
    error = np.sqrt(np.mean((trace.q[:, 7:] - trace.q_ref) ** 2, axis=0))
    return _longest(trace.joint_names, error)


def _way(summary: Summary) -> float | None:
    """Return the way per cycle along the heading, without cycles between both ends [m]."""
    if summary.cycles:
        return summary.distance
    if len(summary.way) < 2:
        return None
    return float(np.linalg.norm(summary.way[-1, 1:3] - summary.way[0, 1:3]))


def _sampled(trace: Trace, size: Array, limit: Array) -> JointShare:
    """Return the joint that is at a limit at most samples; a limit of 0 is none."""
    least = np.where(limit > 0.0, LIMITED_TORQUE_SHARE * limit, np.inf)
    return _longest(trace.joint_names, np.mean(size >= least, axis=0))


def _longest(names: tuple[str, ...], shares: Array) -> JointShare:
    if not len(names) or not np.any(shares > 0.0):
        return NEVER
    worst = int(np.argmax(shares))
    return JointShare(names[worst], float(shares[worst]), int(np.count_nonzero(shares)))
