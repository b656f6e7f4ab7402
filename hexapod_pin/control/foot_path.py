r"""Planned foot paths of a gait, in the base frame.

The body is planned first: a planar pose X(t) = exp(S(t) xi) with a constant body twist
xi = (speed cos heading, speed sin heading, turn_rate), where S' rises smoothly from 0 to 1, stays
there, and may fall back to 0. Then the feet, in the world:

- a foothold is the standing position of the foot under the body's pose at mid-stance, and does
  not move while the foot is down, so no path scrubs, straight or turning;
- a swing goes from one foothold to the next along 10 s^3 - 15 s^4 + 6 s^5 (minimum jerk) and
  rises by lift * 64 s^3 (1 - s)^3: velocity and acceleration relative to the ground are zero at
  lift-off and at touch-down; a swing between equal footholds does not lift.

At t = 0 the robot stands; a leg whose swing would already be under way waits for its next one.
The paths in the base frame are twice continuously differentiable.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.control.gait import Gait
from hexapod_pin.errors import ParameterError

RAMP_CYCLES = 1.25
"""Cycles over which the body speeds up from standing, and slows down to it.

*Assumed*: the longest ramp after which every duty from 1/2 up is periodic from the second cycle,
and long enough that starting and stopping the built-in gaits reaches as far as steady walking,
within 2 % of the stroke (one cycle would let the last leg to lift off trail further).
"""

TRANSIENT_CYCLES = 2
"""Whole cycles after which the paths are periodic: RAMP_CYCLES + 1 - duty / 2, rounded up."""

_STILL = 1e-9  # footholds [m] and times [cycles] closer than this are equal


@dataclass(frozen=True)
class FootPath:
    """The planned motion of six feet relative to a level base at its standing height.

    Attributes:
        gait: the gait.
        neutral_feet: standing foot centres in the base frame, legs in gait order [m]. (6, 3).
        stop_at: time at which the robot stands still again on its neutral feet [s]; None walks on.

    Raises:
        ParameterError: feet of the wrong shape, or a stop too early for starting and stopping.
    """

    gait: Gait
    neutral_feet: Array
    stop_at: float | None = None
    _halt: float = field(init=False, repr=False, default=np.inf)  # the body's last motion [s]

    def __post_init__(self) -> None:
        """Check and copy the arguments."""
        feet = np.array(self.neutral_feet, dtype=float)
        if feet.shape != (6, 3) or not np.isfinite(feet).all():
            raise ParameterError("FootPath.neutral_feet", feet.shape, "finite, of shape (6, 3)")
        feet.flags.writeable = False
        object.__setattr__(self, "neutral_feet", feet)
        if self.stop_at is None:
            return
        earliest = self.earliest_stop(self.gait)
        if not (np.isfinite(self.stop_at) and self.stop_at >= earliest * (1.0 - _STILL)):
            raise ParameterError(
                "stop_at",
                self.stop_at,
                f"at least {earliest:g} s",
                "Starting, stopping and the last steps take that long at this cycle time.",
            )
        settle = (1.0 - self.gait.duty / 2.0) * self.gait.cycle_time
        object.__setattr__(self, "_halt", self.stop_at - settle)

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
        ramp = RAMP_CYCLES * self.gait.cycle_time
        settle = (1.0 - self.gait.duty / 2.0) * self.gait.cycle_time
        return self._halt - ramp - settle

    def events(self, until: float) -> Array:
        """Return the times in (0, until) at which a third derivative may jump [s], ascending.

        These are the placements and lift-offs of all legs and the ends of the speed ramps.
        """
        period, ramp = self.gait.cycle_time, RAMP_CYCLES * self.gait.cycle_time
        placed = np.arange(-1, int(until / period) + 2)[:, None] + np.array(self.gait.phases)
        ramps = [ramp, self._halt - ramp, self._halt]
        times = np.concatenate([placed.ravel(), (placed + self.gait.duty).ravel()]) * period
        times = np.sort(np.concatenate([times, ramps]))
        margin = 1e-6 * period
        times = times[(times > margin) & (times < until - margin)]
        return times[np.diff(times, prepend=-np.inf) > margin]

    def body_pose(self, time: ArrayLike) -> Array:
        """Return the planned planar pose of the base in the world.

        Args:
            time: [s]. Shape (K,).

        Returns:
            x, y [m] and yaw [rad], from 0 at t = 0. Shape (K, 3).
        """
        elapsed = self._elapsed(np.asarray(time, dtype=float))[0]
        yaw = self.gait.turn_rate * elapsed
        half = np.sinc(yaw / (2 * np.pi))  # sin(yaw / 2) / (yaw / 2)
        along = self.gait.speed * elapsed * half
        course = self.gait.heading + yaw / 2
        return np.stack([along * np.cos(course), along * np.sin(course), yaw], axis=-1)

    def stance(self, time: ArrayLike) -> NDArray[np.bool_]:
        """Return which feet are planned to be on the ground. Shape (K,) -> (K, 6)."""
        return self._feet(np.asarray(time, dtype=float))[2]

    def positions(self, time: ArrayLike) -> Array:
        """Return foot centres in the base frame [m]. Shape (K,) -> (K, 6, 3)."""
        t = np.asarray(time, dtype=float)
        p_WF, _, _ = self._feet(t)
        return self._to_base(t, p_WF)

    def velocities(self, time: ArrayLike) -> Array:
        """Return d/dt of `positions`, base axes [m/s]. Shape (K,) -> (K, 6, 3)."""
        t = np.asarray(time, dtype=float)
        p_WF, v_WF, _ = self._feet(t)
        p_BF = self._to_base(t, p_WF)
        pace = self._elapsed(t)[1][:, None]
        heading, omega = self.gait.heading, pace * self.gait.turn_rate
        v = _turn(v_WF, -self.body_pose(t)[:, 2, None])
        v[..., 0] -= pace * self.gait.speed * np.cos(heading) - omega * p_BF[..., 1]
        v[..., 1] -= pace * self.gait.speed * np.sin(heading) + omega * p_BF[..., 0]
        return v

    def _to_base(self, time: Array, p_WF: Array) -> Array:
        """Express world points (K, 6, 3) in the planned base frame."""
        pose = self.body_pose(time)
        moved = p_WF.copy()
        moved[..., :2] -= pose[:, None, :2]
        return _turn(moved, -pose[:, 2, None])

    def _elapsed(self, time: Array) -> tuple[Array, Array]:
        """Return S(t), the time walked at full speed so far [s], and S'(t)."""
        ramp = RAMP_CYCLES * self.gait.cycle_time
        start, pace = _ramp(time / ramp)
        elapsed = ramp * start
        if np.isfinite(self._halt):
            lost, slack = _ramp((time - (self._halt - ramp)) / ramp)
            elapsed, pace = elapsed - ramp * lost, pace - slack
        return elapsed, pace

    def _feet(self, time: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return foot positions and velocities in the world (K, 6, 3) and which feet are down."""
        duty, period = self.gait.duty, self.gait.cycle_time
        cycles = time[:, None] / period - np.array(self.gait.phases)
        placement = np.floor(cycles)
        age = cycles - placement
        here, there = self._footholds(placement), self._footholds(placement + 1.0)
        travel = there - here
        moving = (age >= duty) & (np.linalg.norm(travel, axis=-1) > _STILL)
        s = np.where(moving, (age - duty) / (1.0 - duty), 0.0)[..., None]
        rate = np.where(moving, 1.0 / ((1.0 - duty) * period), 0.0)[..., None]
        p = here + travel * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        v = travel * rate * 30.0 * s**2 * (1.0 - s) ** 2
        p[..., 2:] += self.gait.lift * 64.0 * (s * (1.0 - s)) ** 3
        v[..., 2:] += self.gait.lift * rate * 192.0 * (s * (1.0 - s)) ** 2 * (1.0 - 2.0 * s)
        return p, v, ~moving

    def _footholds(self, placement: Array) -> Array:
        """Return where each leg stands in the world after its k-th placement.

        Args:
            placement: k per time and leg; the foot is placed at (k + phase) cycles. Shape (K, 6).

        Returns:
            The neutral foot under the body at mid-stance; under the standing body if the swing
            to that place would have begun before t = 0. Shape (K, 6, 3).
        """
        duty, period = self.gait.duty, self.gait.cycle_time
        placed = placement + np.array(self.gait.phases)
        walked = placed - (1.0 - duty) >= -_STILL
        middle = np.where(walked, (placed + duty / 2.0) * period, 0.0)
        pose = self.body_pose(middle.ravel()).reshape(*middle.shape, 3)
        feet = np.broadcast_to(self.neutral_feet, (*middle.shape, 3))
        p_WF = _turn(feet, pose[..., 2])
        p_WF[..., :2] += pose[..., :2]
        return p_WF


def _ramp(s: Array) -> tuple[Array, Array]:
    """Return the integral over [0, s] of the smooth step 10 s^3 - 15 s^4 + 6 s^5, and the step."""
    inside = np.clip(s, 0.0, 1.0)
    integral = inside**4 * (2.5 - 3.0 * inside + inside**2) + np.maximum(s - 1.0, 0.0)
    return integral, inside**3 * (10.0 - 15.0 * inside + 6.0 * inside**2)


def _turn(p: Array, yaw: Array) -> Array:
    """Rotate points (..., 3) about z by angles that broadcast over (...)."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = c * p[..., 0] - s * p[..., 1], s * p[..., 0] + c * p[..., 1]
    return np.stack([x, y, p[..., 2]], axis=-1)
