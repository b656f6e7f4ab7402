"""Foot paths of a gait are planned in the base frame, and spherical feet roll without slip.

The body is planned first (`body_path`), then the feet, in the world:

- a foothold is the standing position of the foot under the body's pose at mid-stance, and does
  not move while the foot is down, so no path scrubs, straight or turning;
- a swing goes from one foothold to the next along 10 s^3 - 15 s^4 + 6 s^5 (minimum jerk) and
  rises by lift * (1 - (1 - 2 s)^4)^3, so fast that a foot pressed into soft ground by its load is
  free before it moves on; velocity and acceleration relative to the ground are zero at lift-off
  and at touch-down; a swing between equal footholds does not lift.

Where the legs are given, feet are spheres that roll on their footholds: the foothold is
then under the centre at mid-stance, and the contact point does not slip. The swing has the same
velocity and acceleration as the rolling centre at lift-off and at touch-down.

At t = 0 the robot stands; a leg whose swing would already be under way waits for its next one.
The paths in the base frame are twice continuously differentiable.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.control.body_path import (
    COINCIDENT,
    BodyPath,
    Footholds,
    PlanarMotion,
    WalkSchedule,
    last_motion,
)
from hexapod_pin.control.commanded_body import CommandedBody, ForeseenFootholds
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.stances import (
    LONGEST_PIECE_CYCLES,
    POINTS,
    Stances,
    derivative_row,
    integral,
    integral_powers,
    points,
    quintic,
    stances,
)
from hexapod_pin.errors import ParameterError, ReachError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.leg_geometry import joint_rates
from hexapod_pin.robot.rotations import yawed

if TYPE_CHECKING:
    from hexapod_pin.control.body_motion import BodyMotion, TrunkOffset
    from hexapod_pin.control.commanded_body import VelocityCommand
    from hexapod_pin.control.leg_group import LegGroup


@dataclass(frozen=True, eq=False)
class FootPath(WalkSchedule, Immutable):
    """The planned motion of L feet relative to a level base at its standing height.

    Attributes:
        gait: the gait, with L phases.
        neutral_feet: standing foot centres in the base frame, legs in gait order [m]. (L, 3).
        stop_at: time at which the robot stands still again on its neutral feet [s]; None: no stop.
        legs: whose spherical feet roll; None: the feet are points.
        command: velocity to follow instead of the gait's own; None: the gait's stroke, heading and
            turn rate.
        motion: of the trunk relative to the level body; None: the trunk stays level.
        horizon: time until which the roll of the feet is solved at once [s]; 0: until the latest
            time requested.
        body: the planned motion of the base.
        footholds: where the feet stand.

    Raises:
        ParameterError: feet of the wrong shape, or a stop too early for starting and stopping.
    """

    gait: Gait
    neutral_feet: Array
    stop_at: float | None = None
    legs: LegGroup | None = field(default=None, kw_only=True)
    motion: BodyMotion | None = field(default=None, kw_only=True)
    command: VelocityCommand | None = field(default=None, kw_only=True)
    horizon: float = field(default=0.0, kw_only=True)
    body: PlanarMotion = field(init=False, repr=False, compare=False)
    footholds: Footholds = field(init=False, repr=False, compare=False)
    _halt: float = field(init=False, repr=False, compare=False)

    @staticmethod
    def of(six: LegGroup, gait: Gait, **settings: Any) -> FootPath:
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
        kinks = np.zeros(0) if self.motion is None else self.motion.kinks_until(until)
        return self._events((0.0, self.gait.duty), kinks, since, until)

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

    def positions_and_velocities(self, time: ArrayLike) -> tuple[Array, Array]:
        """Return foot centres in the base frame [m] and their rates of change [m/s]. (K, L, 3)."""
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
        p, v = yawed(p_WF, yaw), yawed(v_WF, yaw)
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


# Spherical feet that roll: where their centres are while their contact points do not slip.
#
# A foot fixed to a link that turns at omega (world) has a centre that moves over flat ground, with
# normal z, at v = omega x (r z), so that the material point at the contact is at rest. The centre
# is over its foothold at mid-stance and rolls away from it by d(t), d' = omega x (r z), horizontal.
# omega is that of the trunk and of the joints, whose rates move the contact point with the ground:
#
#     q' = J_c(q)^-1 u_c,  J_c: Jacobian of the contact point, u_c: the ground seen from the trunk
#
# q depends on d: each stance is solved by Picard iteration on polynomials through Chebyshev points.
# In the air the centre goes from one stance's d to the next one's by a quintic with the d, d' and
# d'' of both.

CONVERGED = 1e-13
"""Change of a displacement at which the iteration ends [m]."""

MAX_ITERATIONS = 60

FASTEST_ROLL = 10.0
"""A foot that would roll faster belongs to a leg out of reach [m/s]."""

KEPT_TABLES = 4
"""How many tables are remembered."""


@dataclass(frozen=True, eq=False)
class RollTable:
    """Displacements d(t) of the foot centres of L legs, in the world, piece by piece.

    The M pieces of all legs are in one row, those of the first leg first.

    Attributes:
        marks: where each leg's pieces begin, and the end of its last [s]. L arrays.
        begin: of the pieces [s]. Shape (M,).
        half: half of their lengths [s]. Shape (M,).
        powers: coefficients of s^k, s from -1 to 1 over the piece [m]. Shape (D, M, 2).
    """

    marks: tuple[Array, ...]
    begin: Array
    half: Array
    powers: Array

    @staticmethod
    def of(marks: tuple[Array, ...], powers: list[Array]) -> RollTable:
        """Return the table of legs from their marks and coefficients, (D, M_leg, 2) each."""
        begin = np.concatenate([mark[:-1] for mark in marks])
        half = np.concatenate([0.5 * np.diff(mark) for mark in marks])
        return RollTable(marks, begin, half, np.concatenate(powers, axis=1))

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return d [m] and d' [m/s] at K times inside the table, horizontal. (K, L, 2) each."""
        piece, first = np.empty((len(time), len(self.marks)), dtype=np.intp), 0
        for leg, marks in enumerate(self.marks):
            own = np.searchsorted(marks, time, side="right") - 1
            piece[:, leg] = first + np.clip(own, 0, len(marks) - 2)
            first += len(marks) - 1
        half = self.half[piece]
        s = ((time[:, None] - self.begin[piece]) / half - 1.0)[..., None]
        d = self.powers[-1].take(piece, axis=0)
        slope = np.zeros_like(d)
        for power in self.powers[-2::-1]:  # Horner
            slope *= s
            slope += d
            d *= s
            d += power.take(piece, axis=0)
        slope /= half[..., None]
        return d, slope


@lru_cache(maxsize=KEPT_TABLES)
def roll_table(six: LegGroup, path: FootPath, until: float) -> RollTable:
    """Return how the feet of a path roll, from 0 to some time [s].

    Raises:
        ReachError: a leg cannot reach where its foot would be.
    """
    period = path.gait.cycle_time
    longest = min(LONGEST_PIECE_CYCLES * period, path.shortest_time)
    pieces = stances(path.footholds, path.body, until, longest)
    rate, start = _solve(_Rolling.of(six, path, pieces), pieces, until)
    powers = 0.5 * pieces.length[..., None, None] * (integral_powers() @ rate)
    powers[:, :, 0] += start
    tables = [_with_swings(pieces, powers, leg) for leg in range(len(pieces.begin))]
    return RollTable.of(pieces.marks, tables)


@dataclass(frozen=True, eq=False)
class _Rolling:
    """The motion of the trunk at the points of every piece, and the feet; M = P * POINTS.

    Attributes:
        six: the legs.
        yaw: of the level body [rad]. Shape (L, M).
        p_LF: footholds in the level body frame [m]. Shape (L, M, 3).
        twist: forward and lateral speed and yaw rate of the level body. Shape (L, M, 3).
        trunk: of the trunk relative to the level body; None where they are one.
    """

    six: LegGroup
    yaw: Array
    p_LF: Array
    twist: Array
    trunk: TrunkOffset | None

    @staticmethod
    def of(six: LegGroup, path: FootPath, pieces: Stances) -> _Rolling:
        """Evaluate the motion of a path's body at the points of the pieces."""
        share = 0.5 * (points() + 1.0)
        count = len(pieces.begin)
        time = (pieces.begin[..., None] + pieces.length[..., None] * share).reshape(count, -1)
        pose, twist = path.body.pose_and_twist(time.ravel())
        pose, twist = pose.reshape(count, -1, 3), twist.reshape(count, -1, 3)
        p_LF = np.repeat(pieces.foothold, POINTS, axis=1)
        p_LF[..., :2] -= pose[..., :2]
        trunk = None if path.motion is None else path.motion.offset(time)
        return _Rolling(six, pose[..., 2], yawed(p_LF, -pose[..., 2]), twist, trunk)

    def rate(self, d: Array) -> Array:
        """Return d' [m/s] of displacements d [m] in the world. Shapes (L, M, 2)."""
        legs, radius = self.six.kinematics, self.six.radius[:, None]
        p = self.p_LF + yawed(np.concatenate([d, np.zeros_like(d[..., :1])], axis=-1), -self.yaw)
        sole = p.copy()
        sole[..., 2] -= radius
        vx, vy, turn = np.moveaxis(self.twist, -1, 0)
        ground = np.stack([turn * p[..., 1] - vx, -turn * p[..., 0] - vy, 0.0 * turn], axis=-1)
        if self.trunk is None:
            p_BF, arm, u_B = p, np.array([0.0, 0.0, -1.0]) * radius[..., None], ground
        else:
            p_BF = self.trunk.into(p)
            p_sole, u_B = self.trunk.motion_into(sole, ground)
            arm = p_sole - p_BF
        q = legs.unlimited(p_BF)
        axes = legs.chain.axes(q)
        jacobian = legs.jacobian(q) + _cross(axes, arm[..., None])
        qdot = joint_rates(jacobian, u_B, legs.task)[..., None]
        omega = (axes @ qdot)[..., 0]
        if self.trunk is not None:
            omega = self.trunk.turned_out(omega)
        roll = radius[..., None] * np.stack([omega[..., 1], -omega[..., 0], 0.0 * turn], axis=-1)
        return yawed(roll, self.yaw)[..., :2]

    def require_reach(self, d: Array) -> None:
        """Raise ReachError if a leg cannot reach the displaced footholds."""
        p = self.p_LF + yawed(np.concatenate([d, np.zeros_like(d[..., :1])], axis=-1), -self.yaw)
        self.six.kinematics.inverse(p if self.trunk is None else self.trunk.into(p))


def _solve(rolling: _Rolling, pieces: Stances, until: float) -> tuple[Array, Array]:
    """Return d' at the points (L, P, POINTS, 2) [m/s] and d where each piece begins (L, P, 2) [m].

    Pieces after `until` [s] only serve as ends of swings: out of reach they do not roll.

    Raises:
        ReachError: a leg cannot reach where its foot would be.
    """
    half, late = 0.5 * pieces.length[..., None, None], pieces.begin >= until
    d = np.zeros((*pieces.begin.shape, POINTS, 2))
    change = np.full(len(d), np.inf)
    with np.errstate(all="ignore"):
        for _ in range(MAX_ITERATIONS):
            try:
                rate = rolling.rate(d.reshape(len(d), -1, 2)).reshape(d.shape)
                rate[late & ~(np.abs(rate).max(axis=(2, 3)) < FASTEST_ROLL)] = 0.0
            except np.linalg.LinAlgError:
                break
            within = half * (integral() @ rate)
            total = np.cumsum(within[:, :, -1], axis=1)
            passed = np.concatenate([np.zeros_like(total[:, :1]), total], axis=1)
            start = passed[:, :-1] - np.take_along_axis(passed, pieces.anchor[..., None], axis=1)
            before, d = d, start[:, :, None] + within
            moved = np.abs(d - before).max(axis=(2, 3))
            change = np.where(late, 0.0, moved).max(axis=1)
            if not (moved > CONVERGED).any():
                break
    if (change <= CONVERGED).all():
        return rate, start
    rolling.require_reach(np.zeros((len(d), rolling.yaw.shape[1], 2)))
    name = rolling.six.legs[int(np.argmax(change))].name
    raise ReachError(name, "the roll of the feet has no solution: a leg is close to its full reach")


def _with_swings(pieces: Stances, powers: Array, leg: int) -> Array:
    """Return a leg's coefficients of stances and swings in turn. Shape (D, M, 2)."""
    down = pieces.down[leg]
    count = int(down.sum())
    own = powers[leg, :count]
    table = np.zeros((powers.shape[2], len(down), 2))
    table[:, down] = np.swapaxes(own, 0, 1)
    swing = np.flatnonzero(~down)
    before = np.cumsum(down)[swing] - 1
    duration = np.diff(pieces.marks[leg])[swing]
    ends = []
    for piece, s in ((before, 1.0), (before + 1, -1.0)):
        shrink = (duration / pieces.length[leg, piece])[:, None]
        value, slope, bend = (derivative_row(order, s) @ own[piece] for order in range(3))
        ends += [value[:, 0], slope[:, 0] * shrink, bend[:, 0] * shrink**2]
    table[:6, swing] = np.tensordot(quintic(), np.stack(ends), axes=1)
    return table


def _cross(columns: Array, arm: Array) -> Array:
    """Return columns x arm, (..., 3, n) and (..., 3, 1)."""
    (a1, a2, a3), (b1, b2, b3) = np.moveaxis(columns, -2, 0), np.moveaxis(arm, -2, 0)
    return np.stack([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], axis=-2)
