"""What the core follows between two calls, and what a trace says of a walk."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hexapod_pin.arrays import Array


class SetPoints(Protocol):
    """Knots of joint set-points, and when they repeat; `JointTrajectory` is one."""

    @property
    def time(self) -> Array:
        """Knot times [s]. Shape (K,)."""
        ...

    @property
    def q(self) -> Array:
        """Joint angles at the knots [rad]. Shape (K, n)."""
        ...

    @property
    def v(self) -> Array:
        """Joint rates at the knots [rad/s]. Shape (K, n)."""
        ...

    @property
    def kind(self) -> str:
        """Between the knots: "cubic", "held" or "linear"."""
        ...

    @property
    def cycle_time(self) -> float | None:
        """Period of the gait [s]; None without one."""
        ...

    @property
    def steady_from(self) -> float:
        """Start of the time in which the motion repeats [s]."""
        ...

    @property
    def steady_until(self) -> float:
        """End of that time [s]."""
        ...

    @property
    def travel_direction(self) -> Array:
        """Unit vector in the world, at the start. Shape (2,)."""
        ...

    @property
    def speed(self) -> float:
        """Nominal speed along it [m/s]."""
        ...


@dataclass(frozen=True, eq=False)
class LiveSetPoints:
    """Set-points that wait for commands; attributes as of `SetPoints`."""

    time: Array
    q: Array
    v: Array
    cycle_time: float | None
    steady_from: float
    steady_until: float
    travel_direction: Array
    speed: float
    kind: str = "held"

    @classmethod
    def at(cls, time: float, q: Array, gait: object = None, end: float = 0.0) -> LiveSetPoints:
        """Return set-points that stay at `q` (n,) [rad] from `time` [s].

        Args:
            time: [s].
            q: [rad]. Shape (n,).
            gait: the gait that a controller walks, if any: cycle_time, heading and speed are read.
            end: end of the run, as far as it is known [s].
        """
        cycle, heading, speed, first = _walk(gait)
        last = end if cycle is None else max(0.0, float(np.floor(end / cycle + 1e-9)) * cycle)
        return cls(
            time=np.array([time]),
            q=q[None, :],
            v=np.zeros((1, len(q))),
            cycle_time=cycle,
            steady_from=first,
            steady_until=last,
            travel_direction=np.array([np.cos(heading), np.sin(heading)]),
            speed=speed,
        )


def _walk(gait: object) -> tuple[float | None, float, float, float]:
    """Return cycle time [s], heading [rad], speed [m/s] and start of steady walking [s]."""
    from hexapod_pin.control.foot_path import TRANSIENT_CYCLES
    from hexapod_pin.control.gait import Gait

    if not isinstance(gait, Gait):
        return None, 0.0, 0.0, 0.0
    return gait.cycle_time, gait.heading, gait.speed, TRANSIENT_CYCLES * gait.cycle_time
