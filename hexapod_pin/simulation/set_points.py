"""What the drives of a run follow until its first command."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import JointTrajectory, whole_cycles
from hexapod_pin.control.walk_schedule import TRANSIENT_CYCLES


def waiting(q: Array, gait: Gait | None = None, end: float = 0.0) -> JointTrajectory:
    """Return set-points that stay at `q` (n,) [rad].

    Args:
        q: [rad]. Shape (n,).
        gait: the gait that a controller walks, if any: a trace knows its cycles by it.
        end: end of the run, as far as it is known [s].
    """
    heading = 0.0 if gait is None else gait.heading
    return JointTrajectory(
        time=np.zeros(1),
        q=q[None, :],
        v=np.zeros((1, len(q))),
        cycle_time=None if gait is None else gait.cycle_time,
        steady_from=0.0 if gait is None else TRANSIENT_CYCLES * gait.cycle_time,
        steady_until=end if gait is None else whole_cycles(end, gait.cycle_time),
        travel_direction=np.array([np.cos(heading), np.sin(heading)]),
        speed=0.0 if gait is None else gait.speed,
        kind="held",
    )
