"""The planar path of the body is planned first; footholds and the steady time of a walk follow.

xi = (speed cos heading, speed sin heading, turn_rate). S' rises smoothly from 0 to 1, stays there,
and falls back to 0 where the body stops.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import cycles_between
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.rotations import yawed

RAMP_CYCLES = 1.25
"""Cycles over which the body speeds up from standing, and slows down to it.

*Assumed*: the longest ramp after which every duty from 1/2 up is periodic from the second cycle,
and long enough that starting and stopping the built-in gaits reaches as far as steady walking,
within 2 % of the stroke (one cycle would let the last leg to lift off trail further).
"""


class PlanarMotion(ABC):
    """The planned motion of a base in the plane, from rest at t = 0."""

    gait: Gait

    @property
    @abstractmethod
    def kinks(self) -> Array:
        """Times at which a third derivative of the pose jumps [s]."""

    @abstractmethod
    def pose_and_twist(self, time: Array) -> tuple[Array, Array]:
        """Return `pose`, and the forward and lateral speed [m/s] and yaw rate [rad/s], (K, 3)."""

    def pose(self, time: Array) -> Array:
        """Return x, y [m] and yaw [rad] in the world, from 0 at t = 0. Shape (K,) -> (K, 3)."""
        return self.pose_and_twist(time)[0]


@dataclass(frozen=True)
class BodyPath(PlanarMotion):
    """The planned motion of the base in the plane, from rest at t = 0.

    Attributes:
        gait: the gait.
        halt: time of the body's last motion [s]; infinite without a stop.
    """

    gait: Gait
    halt: float = np.inf

    @property
    def ramp(self) -> float:
        """Duration of speeding up and of slowing down [s]."""
        return RAMP_CYCLES * self.gait.cycle_time

    def pose_and_twist(self, time: Array) -> tuple[Array, Array]:
        """Return `pose`, and the forward and lateral speed [m/s] and yaw rate [rad/s], (K, 3)."""
        elapsed, pace = self._elapsed(time)
        yaw = self.gait.turn_rate * elapsed
        half = np.sinc(yaw / (2 * np.pi))  # sin(yaw / 2) / (yaw / 2)
        along = self.gait.speed * elapsed * half
        course = self.gait.heading + yaw / 2
        pose = np.stack([along * np.cos(course), along * np.sin(course), yaw], axis=-1)
        pace, heading = pace[..., None], self.gait.heading
        full_speed = np.array([np.cos(heading), np.sin(heading)])
        velocity = pace * self.gait.speed * full_speed
        return pose, np.concatenate([velocity, pace * self.gait.turn_rate], axis=-1)

    def twist(self, time: Array) -> Array:
        """Return the forward and lateral speed [m/s] and yaw rate [rad/s]. (K,) -> (K, 3)."""
        return self.pose_and_twist(time)[1]

    @property
    def kinks(self) -> Array:
        """Times at which a third derivative of the pose jumps [s]."""
        times: Array = np.array([self.ramp, self.halt - self.ramp, self.halt])
        finite: Array = times[np.isfinite(times)]
        return finite

    def _elapsed(self, time: Array) -> tuple[Array, Array]:
        """Return S(t), the time walked at full speed so far [s], and S'(t)."""
        ramp = self.ramp
        start, pace = smooth_step(time / ramp)
        elapsed = ramp * start
        if np.isfinite(self.halt):
            lost, slowdown = smooth_step((time - (self.halt - ramp)) / ramp)
            elapsed, pace = elapsed - ramp * lost, pace - slowdown
        return elapsed, pace


def smooth_step(s: Array) -> tuple[Array, Array]:
    """Return the integral over [0, s] of the smooth step 10 s^3 - 15 s^4 + 6 s^5, and the step."""
    inside = np.clip(s, 0.0, 1.0)
    integral = inside**4 * (2.5 - 3.0 * inside + inside**2) + np.maximum(s - 1.0, 0.0)
    return integral, inside**3 * (10.0 - 15.0 * inside + 6.0 * inside**2)


# Where the feet of a gait stand in the world, placement by placement.

COINCIDENT = 1e-9
"""Footholds [m] and times [cycles] closer than this are the same."""


@dataclass(frozen=True, eq=False)
class Footholds(Immutable):
    """The footholds of a planned walk.

    Attributes:
        gait: the gait.
        neutral_feet: standing foot centres in the base frame, legs in gait order [m]. (L, 3).
        body: the planned motion of the base.
    """

    gait: Gait
    neutral_feet: Array
    body: PlanarMotion

    def at(self, placement: Array) -> Array:
        """Return where each leg stands in the world after its k-th placement [m].

        Args:
            placement: k per time and leg; the foot is placed at (k + phase) cycles. Shape (K, L).

        Returns:
            The neutral foot under the body at mid-stance; under the standing body if the swing
            to that place would have begun before t = 0. Shape (K, L, 3).
        """
        middle = self.middle(placement)
        return self.under(self.body.pose(middle.ravel()).reshape(*middle.shape, 3))

    def under(self, pose: Array) -> Array:
        """Return the standing feet under poses (K, L, 3) of the body in the world, a leg each."""
        feet = np.broadcast_to(self.neutral_feet, pose.shape)
        p_WF = yawed(feet, pose[..., 2])
        p_WF[..., :2] += pose[..., :2]
        return p_WF

    def middle(self, placement: Array) -> Array:
        """Return the middle of the stances after the k-th placements, 0 of the first [s].

        Args:
            placement: as of `at`. Shape (K, L).
        """
        duty, period = self.gait.duty, self.gait.cycle_time
        placed = placement + np.array(self.gait.phases)
        walked = placed - (1.0 - duty) >= -COINCIDENT
        return np.where(walked, (placed + duty / 2.0) * period, 0.0)

    def with_travel(self, placement: Array) -> tuple[Array, Array]:
        """Return the footholds after the k-th placements and the travel to the next [m].

        Args:
            placement: k per time and leg. Shape (K, L).

        Returns:
            Shape (K, L, 3) each, in the world.
        """
        first, last = (placement.min(), placement.max()) if placement.size else (0.0, 0.0)
        count = int(last - first) + 2
        if count > len(placement):  # a table would be larger than the result
            here = self.at(placement)
            return here, self.at(placement + 1.0) - here
        table = self.at(np.tile(first + np.arange(count)[:, None], (1, len(self.neutral_feet))))
        row, leg = (placement - first).astype(int), np.arange(len(self.neutral_feet))
        return table[row, leg], np.diff(table, axis=0)[row, leg]


# When a walk is steady, and when it can stop: the same for feet on straight paths and on arcs.

TRANSIENT_CYCLES = 2
"""Whole cycles after which the paths are periodic: RAMP_CYCLES + 1 - duty / 2, rounded up."""


EVENT_SEPARATION_CYCLES = 1e-6
"""Events closer than this are one event [cycles]."""


@checked
class WalkSchedule(ABC):
    """The times and the base of a walk; the base class of `FootPath` and `ArcPath`.

    Attributes:
        gait: the gait.
        stop_at: time at which the robot stands still again [s]; None: no stop.
        body: the planned motion of the base.
    """

    gait: Gait
    stop_at: float | None
    body: PlanarMotion
    _halt: float

    @abstractmethod
    def positions_and_velocities(self, time: ArrayLike) -> tuple[Array, Array]:
        """Return foot centres in the base frame [m] and their rates of change [m/s].

        Args:
            time: [s]. Shape (K,).

        Returns:
            Positions and velocities in base axes. Shape (K, L, 3) each.
        """

    def positions(self, time: ArrayLike) -> Array:
        """Return foot centres in the base frame [m]. Shape (K,) -> (K, L, 3)."""
        return self.positions_and_velocities(time)[0]

    def velocities(self, time: ArrayLike) -> Array:
        """Return d/dt of `positions`, base axes [m/s]. Shape (K,) -> (K, L, 3)."""
        return self.positions_and_velocities(time)[1]

    def body_pose(self, time: ArrayLike) -> Array:
        """Return the planned planar pose of the base in the world.

        Args:
            time: [s]. Shape (K,).

        Returns:
            x, y [m] and yaw [rad], from 0 at t = 0. Shape (K, 3).
        """
        return self.body.pose(np.asarray(time, dtype=float))

    def _events(self, marks: ArrayLike, others: Array, since: float, until: float) -> Array:
        """Return marks of all legs [cycles after a placement] and other times, as of `events`."""
        period = self.gait.cycle_time
        placed = cycles_between(since, until, period)[:, None] + np.array(self.gait.phases)
        times = ((placed[..., None] + np.asarray(marks)) * period).ravel()
        times = np.sort(np.concatenate([times, self.body.kinks, others]))
        margin = EVENT_SEPARATION_CYCLES * period
        times = times[(times > since + margin) & (times < until - margin)]
        return times[np.diff(times, prepend=-np.inf) > margin]

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
