"""Joint torques are taken apart into stance and swing, by contact or by the planned schedule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.joint_moments import JointMoments, joint_moments
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.result_files import without_non_finite
from hexapod_pin.results.schema import require_known
from hexapod_pin.results.steady_window import Window, steady_window, summary_window
from hexapod_pin.results.trace import Trace
from hexapod_pin.text_table import Table

# Joint torques in stance and in swing apart: retraction and protraction of each leg.

PHASES = ("retraction", "protraction")
"""What a leg does in stance, and in swing (the terms of [S2])."""


class PhaseNumbers(NamedTuple):
    """Joint torques of both `PHASES` within the window of a trace; NaN where a phase is empty."""

    peak: Array  # largest size (2, n) [N m]
    rms: Array  # (2, n) [N m]
    time: Array  # of each phase in the window (2, n) [s]
    torque_rms_error: Array  # how far sampling may have moved `rms` (2, n) [N m]


def scheduled_phase_torque(trace: Trace, down: NDArray[np.bool_]) -> PhaseNumbers:
    """Return peak and RMS of the joint torques in each phase.

    Integrals are trapezoidal over samples, an interval between two samples belonging to one phase.
    A phase's peak is that of samples, or the peak over accepted steps where that falls into it.
    What the whole window's integral of torque^2 misses of that over accepted steps may all belong
    to either phase: that bounds the error of its RMS, unless errors of both cancel.

    Args:
        trace: of a run with a summary.
        down: whether the schedule has the leg of each joint on the ground, in each interval between
            samples. Shape (T - 1, n).

    Raises:
        ParameterError: `down` has another shape, or the run is too short for one whole cycle.
    """
    if down.shape != (len(trace.time) - 1, len(trace.joint_names)):
        raise ParameterError("down", down.shape, "intervals by joints")
    summary = trace.summary
    window = summary_window(summary, trace.time).samples
    time, torque = trace.time[window], trace.torque[window]
    phase = down[window.start : window.stop - 1]
    length = np.diff(time)[:, None]
    square = 0.5 * (torque[:-1] ** 2 + torque[1:] ** 2) * length
    size = np.maximum(np.abs(torque[:-1]), np.abs(torque[1:]))
    moment = np.clip(np.searchsorted(time, summary.torque_peak_time) - 1, 0, len(phase) - 1)
    at_peak = phase[moment, np.arange(phase.shape[1])]
    rows = []
    for inside, holds_peak in ((phase, at_peak), (~phase, ~at_peak)):
        total = (inside * length).sum(axis=0)
        sampled = np.where(inside, size, 0.0).max(axis=0)
        peak = np.where(holds_peak, np.maximum(sampled, np.abs(summary.torque_peak)), sampled)
        with np.errstate(invalid="ignore", divide="ignore"):
            rms = np.sqrt((inside * square).sum(axis=0) / total)
        rows.append((np.where(total > 0.0, peak, np.nan), rms, total))
    peak, rms, total = (np.stack(column) for column in zip(*rows, strict=True))
    missed = np.abs(square.sum(axis=0) - summary.torque_rms**2 * (time[-1] - time[0]))
    with np.errstate(invalid="ignore", divide="ignore"):
        error = np.sqrt(rms**2 + missed / total) - rms
    return PhaseNumbers(peak, rms, total, error)


# What each joint delivers while its leg's foot is on the ground, and while it is in the air.

RETRACTION, PROTRACTION = PHASES


@dataclass(frozen=True)
class PhaseTorque:
    """One joint in one phase of its leg; None where the phase does not occur."""

    joint: str
    kind: str  # "coxa", "femur", "tibia" or "joint"
    foot: str
    phase: str  # "retraction" or "protraction"
    share: float  # of the time, 0 to 1
    torque_peak: float | None  # largest |torque| of the motor at the samples [N m]
    torque_p99: float | None  # 99th percentile of |torque| [N m]
    torque_rms: float | None  # [N m]
    moment_peak: float | None  # largest total moment across the joint [N m]
    moment_p99: float | None  # [N m]
    moment_rms: float | None  # [N m]


@dataclass(frozen=True)
class PhaseTorques(Immutable):
    """All joints in both phases.

    Attributes:
        window: the time that the numbers are of.
        rows: one for every joint and phase, in the trace's order.
    """

    window: Window
    rows: tuple[PhaseTorque, ...]

    def row(self, joint: str, phase: str) -> PhaseTorque:
        """Return the row of one joint in "retraction" or "protraction".

        Raises:
            UnknownNameError: there is no such joint or phase.
        """
        require_known("phase", phase, PHASES)
        found = [row for row in self.rows if row.joint == joint and row.phase == phase]
        if not found:
            raise UnknownNameError("joint", joint, sorted({row.joint for row in self.rows}))
        return found[0]

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data."""
        finite: dict[str, Any] = without_non_finite(asdict(self))
        return finite

    def table(self) -> str:
        """Return a plain text table."""
        head = ("joint", "phase", "time\n[%]", "torque peak\n[N m]", "p99\n[N m]", "RMS\n[N m]",
                "moment peak\n[N m]", "p99\n[N m]", "RMS\n[N m]")  # fmt: skip
        rows = [
            [row.joint, row.phase, f"{100.0 * row.share:.1f}", *_numbers(row)] for row in self.rows
        ]
        return "\n".join(Table("", head, rows, "<>").lines())


@checked
def phase_torques(trace: Trace) -> PhaseTorques:
    """Return what every joint delivers in retraction and in protraction.

    A leg retracts at a sample where its foot was pushed (mean normal force > 0) in the interval
    that ends there. A joint belongs to the foot that it carries in the URDF; joints that carry none
    or several have no row. Torques are the motors' at the samples, moments those of
    `joint_moments`; RMS is over time, a percentile over samples.

    Args:
        trace: of a run; must hold its URDF.

    Raises:
        ParameterError: the robot cannot be built again from `trace.run`, or the run is too short.
    """
    window, robot, moments = steady_window(trace), RecordedRobot.of(trace), joint_moments(trace)
    above = [robot.joints_above(f) for f in range(len(robot.robot.feet))]
    kinds = joint_kinds(trace.joint_names, len(robot.robot.feet), trace.run.robot.joint_kinds)
    rows = []
    for j in range(len(trace.joint_names)):
        feet = [f for f, joints in enumerate(above) if j in joints]
        if len(feet) == 1:
            rows += _rows(trace, moments, j, feet[0], kinds)
    return PhaseTorques(window, tuple(rows))


def _rows(
    trace: Trace, moments: JointMoments, j: int, foot: int, kinds: Sequence[str]
) -> list[PhaseTorque]:
    """Return the rows of joint number j in both phases of its leg."""
    ends = moments.ends
    length, down = trace.time[ends] - trace.time[ends - 1], trace.contact[ends, foot]
    torque, moment = trace.torque[ends, j], moments.moment[:, j]
    rows = []
    for phase, during in ((RETRACTION, down), (PROTRACTION, ~down)):
        share = float(length[during].sum() / length.sum())
        sizes = (*_sizes(torque, length, during), *_sizes(moment, length, during))
        names = (trace.joint_names[j], kinds[j], trace.foot_names[foot])
        rows.append(PhaseTorque(*names, phase, share, *sizes))
    return rows


def _sizes(
    values: Array, length: Array, during: NDArray[np.bool_]
) -> tuple[float, float, float] | tuple[None, None, None]:
    """Return peak, 99th percentile and RMS of the size of samples."""
    if not during.any():
        return None, None, None
    size, weight = np.abs(values[during]), length[during]
    rms = float(np.sqrt(np.sum(weight * size**2) / weight.sum()))
    return float(size.max()), float(np.percentile(size, 99.0)), rms


def _numbers(row: PhaseTorque) -> tuple[float | None, ...]:
    return (row.torque_peak, row.torque_p99, row.torque_rms,
            row.moment_peak, row.moment_p99, row.moment_rms)  # fmt: skip
