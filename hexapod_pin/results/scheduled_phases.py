"""Joint torques in stance and in swing apart: retraction and protraction of each leg."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.steady_window import summary_window
from hexapod_pin.results.trace import Trace

PHASES = ("retraction", "protraction")
"""What a leg does in stance, and in swing ([S2]'s words)."""


class PhaseNumbers(NamedTuple):
    """Joint torques of both `PHASES` within the window of a trace; NaN where a phase is empty."""

    peak: Array  # largest size (2, n) [N m]
    rms: Array  # (2, n) [N m]
    time: Array  # of each phase in the window (2, n) [s]
    rms_error: Array  # how far sampling may have moved `rms` (2, n) [N m]


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
