"""When a walk is steady, and when it can stop: the same for feet on straight paths and on arcs."""

from __future__ import annotations

import numpy as np

from hexapod_pin.control.body_path import RAMP_CYCLES
from hexapod_pin.control.footholds import COINCIDENT
from hexapod_pin.control.gait import Gait
from hexapod_pin.errors import ParameterError

TRANSIENT_CYCLES = 2
"""Whole cycles after which the paths are periodic: RAMP_CYCLES + 1 - duty / 2, rounded up."""


class WalkSchedule:
    """What a path of six feet with a `gait` and a `stop_at` [s] answers about its times.

    Attributes:
        gait: the gait.
        stop_at: time at which the robot stands still again [s]; None walks on.
    """

    gait: Gait
    stop_at: float | None
    _halt: float

    @staticmethod
    def earliest_stop(gait: Gait) -> float:
        """Return the earliest `stop_at` that leaves time to start, stop and make last steps [s]."""
        return (2.0 * RAMP_CYCLES + 1.0 - gait.duty / 2.0) * gait.cycle_time

    @property
    def steady_from(self) -> float:
        """Time from which the paths repeat every cycle: TRANSIENT_CYCLES cycles [s]."""
        return TRANSIENT_CYCLES * self.gait.cycle_time

    @property
    def steady_until(self) -> float:
        """Time at which the first leg prepares for the stop; infinite without one [s]."""
        return self._halt - RAMP_CYCLES * self.gait.cycle_time - settling(self.gait)


def settling(gait: Gait) -> float:
    """Return the time from a lift-off to mid-stance on the next foothold [s]."""
    return (1.0 - gait.duty / 2.0) * gait.cycle_time


def last_motion(gait: Gait, stop_at: float | None) -> float:
    """Return the time of the body's last motion [s]; infinite without a stop.

    Raises:
        ParameterError: a stop too early for starting and stopping.
    """
    if stop_at is None:
        return np.inf
    earliest = WalkSchedule.earliest_stop(gait)
    if not (np.isfinite(stop_at) and stop_at >= earliest * (1.0 - COINCIDENT)):
        raise ParameterError(
            "stop_at",
            stop_at,
            f"at least {earliest:g} s",
            "Starting, stopping and the last steps take that long at this cycle time.",
        )
    return stop_at - settling(gait)
