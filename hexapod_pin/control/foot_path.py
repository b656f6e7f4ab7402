r"""Planned foot paths of a gait, in the base frame.

The body is planned first (`body_path`), then the feet, in the world:

- a foothold is the standing position of the foot under the body's pose at mid-stance, and does
  not move while the foot is down, so no path scrubs, straight or turning;
- a swing goes from one foothold to the next along 10 s^3 - 15 s^4 + 6 s^5 (minimum jerk) and
  rises by lift * (1 - (1 - 2 s)^4)^3, so fast that a foot pressed into soft ground by its load is
  free before it moves on; velocity and acceleration relative to the ground are zero at lift-off
  and at touch-down; a swing between equal footholds does not lift.

Where the legs are given, feet are spheres that roll on their footholds (`rolling`): the foothold is
then under the centre at mid-stance, and the contact point does not slip. The swing has the same
velocity and acceleration as the rolling centre at lift-off and at touch-down.

At t = 0 the robot stands; a leg whose swing would already be under way waits for its next one.
The paths in the base frame are twice continuously differentiable.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.control.body_path import BodyPath, PlanarMotion
from hexapod_pin.control.commanded_body import CommandedBody, ForeseenFootholds
from hexapod_pin.control.footholds import COINCIDENT, Footholds, turned
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import cycles_between
from hexapod_pin.control.rolling import roll_table
from hexapod_pin.control.walk_schedule import WalkSchedule, last_motion
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable

if TYPE_CHECKING:
    from hexapod_pin.control.body_motion import BodyMotion
    from hexapod_pin.control.six_legs import SixLegs
    from hexapod_pin.control.velocity_command import VelocityCommand

EVENT_SEPARATION_CYCLES = 1e-6
"""Events closer than this are one event [cycles]."""


@dataclass(frozen=True, eq=False)
class FootPath(WalkSchedule, Immutable):
    """The planned motion of L feet relative to a level base at its standing height.

    Attributes:
        gait: the gait, with L phases.
        neutral_feet: standing foot centres in the base frame, legs in gait order [m]. (L, 3).
        stop_at: time at which the robot stands still again on its neutral feet [s]; None walks on.
        legs: whose spherical feet roll; None: the feet are points.
        command: velocity to follow instead of the gait's own; None: the gait's stroke, heading and
            turn rate.
        motion: of the trunk relative to the level body; None: the trunk stays level.
        horizon: time until which the roll of the feet is solved at once [s]; 0: until the latest
            time asked for.
        body: the planned motion of the base.
        footholds: where the feet stand.

    Raises:
        ParameterError: feet of the wrong shape, or a stop too early for starting and stopping.
    """

    gait: Gait
    neutral_feet: Array
    stop_at: float | None = None
    legs: SixLegs | None = field(default=None, kw_only=True)
    motion: BodyMotion | None = field(default=None, kw_only=True)
    command: VelocityCommand | None = field(default=None, kw_only=True)
    horizon: float = field(default=0.0, kw_only=True)
    body: PlanarMotion = field(init=False, repr=False, compare=False)
    footholds: Footholds = field(init=False, repr=False, compare=False)
    _halt: float = field(init=False, repr=False, compare=False)

    @staticmethod
    def of(six: SixLegs, gait: Gait, **settings: Any) -> FootPath:
        """Return the path of a robot's own feet; `settings` as of `stop_at`, `motion`, `command`.

        Raises:
            GaitError: a gait for other legs, or a command that two-joint legs cannot follow.
        """
        gait, six = six.fitted(gait), six.along(gait, settings.get("command"))
        return FootPath(gait, six.neutral_feet, legs=six, **settings)

    def __post_init__(self) -> None:
        """Check and copy the arguments."""
        feet = read_only(self.neutral_feet)
        shape = (len(self.gait.phases), 3)
        if feet.shape != shape or not np.isfinite(feet).all():
            raise ParameterError("FootPath.neutral_feet", feet.shape, f"finite, of shape {shape}")
        object.__setattr__(self, "neutral_feet", feet)
        halt = last_motion(self.gait, self.stop_at)
        object.__setattr__(self, "_halt", halt)
        if self.command is None:
            path = BodyPath(self.gait, halt=halt)
            object.__setattr__(self, "body", path)
            object.__setattr__(self, "footholds", Footholds(self.gait, feet, path))
        else:
            body = CommandedBody(self.gait, self.command)
            object.__setattr__(self, "body", body)
            object.__setattr__(self, "footholds", ForeseenFootholds(self.gait, feet, body))

    def events(self, until: float, since: float = 0.0) -> Array:
        """Return the times in (since, until) where a third derivative may jump [s], ascending.

        These are the placements and lift-offs of all legs, the ends of the speed ramps and the
        waypoints of the trunk's motion.
        """
        period = self.gait.cycle_time
        cycles = cycles_between(since, until, period)
        placed = cycles[:, None] + np.array(self.gait.phases)
        times = np.concatenate([placed.ravel(), (placed + self.gait.duty).ravel()]) * period
        kinks = np.zeros(0) if self.motion is None else self.motion.kinks_until(until)
        times = np.sort(np.concatenate([times, self.body.kinks, kinks]))
        margin = EVENT_SEPARATION_CYCLES * period
        times = times[(times > since + margin) & (times < until - margin)]
        return times[np.diff(times, prepend=-np.inf) > margin]

    def body_pose(self, time: ArrayLike) -> Array:
        """Return the planned planar pose of the base in the world.

        Args:
            time: [s]. Shape (K,).

        Returns:
            x, y [m] and yaw [rad], from 0 at t = 0. Shape (K, 3).
        """
        return self.body.pose(np.asarray(time, dtype=float))

    def stance(self, time: ArrayLike) -> NDArray[np.bool_]:
        """Return which feet are planned to be on the ground. Shape (K,) -> (K, L)."""
        return self._feet(np.asarray(time, dtype=float))[2]

    @property
    def periodic(self) -> bool:
        """Whether the paths repeat every cycle from `steady_from` to `steady_until`."""
        return self.command is None and (self.motion is None or self.motion.constant)

    @property
    def speed(self) -> float:
        """Nominal speed, of the last step of a velocity command [m/s]."""
        if self.command is None:
            return self.gait.speed
        return float(np.linalg.norm(self.command.twists[-1, :2]))

    @property
    def direction(self) -> Array:
        """Direction of travel at the start; of a velocity command's first motion. Shape (2,)."""
        heading = self.gait.heading
        if self.command is not None:
            moving = [v for v in self.command.twists[:, :2] if v.any()]
            heading = float(np.arctan2(moving[0][1], moving[0][0])) if moving else 0.0
        return np.array([np.cos(heading), np.sin(heading)])

    def solved_until(self, horizon: float) -> FootPath:
        """Return the path with the roll of its feet solved once, until some time [s]."""
        return replace(self, horizon=horizon)

    @property
    def shortest_time(self) -> float:
        """Time in which the trunk's motion is close to a polynomial [s]."""
        return np.inf if self.motion is None else self.motion.shortest_time

    def positions(self, time: ArrayLike) -> Array:
        """Return foot centres in the base frame [m]. Shape (K,) -> (K, L, 3)."""
        return self.positions_and_velocities(time)[0]

    def velocities(self, time: ArrayLike) -> Array:
        """Return d/dt of `positions`, base axes [m/s]. Shape (K,) -> (K, L, 3)."""
        return self.positions_and_velocities(time)[1]

    def positions_and_velocities(self, time: ArrayLike) -> tuple[Array, Array]:
        """Return foot centres in the base frame [m] and their rates of change [m/s].

        Args:
            time: [s]. Shape (K,).

        Returns:
            Positions and velocities in base axes. Shape (K, L, 3) each.
        """
        t = np.asarray(time, dtype=float)
        p_WF, v_WF, _ = self._feet(t)
        if self.legs is not None and self.legs.radius.any() and t.size:
            until = max(self.horizon, float(t.max()))
            rolled, rate = roll_table(self.legs, self, until).at(t)
            p_WF[..., :2] += rolled
            v_WF[..., :2] += rate
        pose, twist = self.body.pose_and_twist(t)
        yaw, (forward, lateral, turn) = -pose[:, 2, None], np.moveaxis(twist[:, None], -1, 0)
        p_WF[..., :2] -= pose[:, None, :2]
        p, v = turned(p_WF, yaw), turned(v_WF, yaw)
        v[..., 0] -= forward - turn * p[..., 1]
        v[..., 1] -= lateral + turn * p[..., 0]
        return (p, v) if self.motion is None else self.motion.offset(t[:, None]).motion_into(p, v)

    def _feet(self, time: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return foot positions and velocities in the world (K, L, 3) and which feet are down."""
        duty, period = self.gait.duty, self.gait.cycle_time
        cycles = time[:, None] / period - np.array(self.gait.phases)
        placement = np.floor(cycles)
        age = cycles - placement
        p, travel = self.footholds.with_travel(placement)
        v = np.zeros_like(p)
        moving = (age >= duty) & (np.linalg.norm(travel, axis=-1) > COINCIDENT)
        p[moving], v[moving] = self._swing(p[moving], travel[moving], age[moving])
        return p, v, ~moving

    def _swing(self, here: Array, travel: Array, age: Array) -> tuple[Array, Array]:
        """Return positions and velocities of M feet in the air, in the world, (M, 3) each.

        Args:
            here: the footholds they leave [m]. Shape (M, 3).
            travel: from there to the next [m]. Shape (M, 3).
            age: time since their placement [cycles]. Shape (M,).
        """
        duty, lift = self.gait.duty, self.gait.lift
        s = ((age - duty) / (1.0 - duty))[:, None]
        rate = 1.0 / ((1.0 - duty) * self.gait.cycle_time)
        p = here + travel * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        v = travel * rate * 30.0 * s**2 * (1.0 - s) ** 2
        x = 1.0 - 2.0 * s
        p[:, 2:] += lift * (1.0 - x**4) ** 3
        v[:, 2:] += lift * rate * 24.0 * x**3 * (1.0 - x**4) ** 2
        return p, v
