"""Planned planar motion of the body: X(t) = exp(S(t) xi) with a constant body twist.

xi = (speed cos heading, speed sin heading, turn_rate). S' rises smoothly from 0 to 1, stays there,
and falls back to 0 where the body stops.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.gait import Gait

RAMP_CYCLES = 1.25
"""Cycles over which the body speeds up from standing, and slows down to it.

*Assumed*: the longest ramp after which every duty from 1/2 up is periodic from the second cycle,
and long enough that starting and stopping the built-in gaits reaches as far as steady walking,
within 2 % of the stroke (one cycle would let the last leg to lift off trail further).
"""


class PlanarMotion(Protocol):
    """The planned motion of a base in the plane, from rest at t = 0."""

    @property
    def gait(self) -> Gait:
        """The gait."""
        ...

    @property
    def kinks(self) -> Array:
        """Times at which a third derivative of the pose jumps [s]."""
        ...

    def pose(self, time: Array) -> Array:
        """Return x, y [m] and yaw [rad] in the world, from 0 at t = 0. Shape (K,) -> (K, 3)."""
        ...

    def pose_and_twist(self, time: Array) -> tuple[Array, Array]:
        """Return `pose`, and the forward and lateral speed [m/s] and yaw rate [rad/s], (K, 3)."""
        ...


@dataclass(frozen=True)
class BodyPath:
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

    def pose(self, time: Array) -> Array:
        """Return x, y [m] and yaw [rad] in the world, from 0 at t = 0. Shape (K,) -> (K, 3)."""
        return self.pose_and_twist(time)[0]

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
