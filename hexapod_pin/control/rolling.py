r"""Spherical feet that roll: where their centres are while their contact points do not slip.

A foot fixed to a link that turns at omega (world) has a centre that moves over flat ground, with
normal z, at v = omega x (r z), so that the material point at the contact is at rest. The centre is
over its foothold at mid-stance and rolls away from it by d(t), d' = omega x (r z), horizontal.
omega is that of the trunk and of the joints, whose rates move the contact point with the ground:

    q' = J_c(q)^-1 u_c,  J_c: Jacobian of the contact point, u_c: the ground seen from the trunk

q depends on d: each stance is solved by Picard iteration on polynomials through Chebyshev points.
In the air the centre goes from one stance's d to the next one's by a quintic with the d, d' and d''
of both.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.chebyshev import (
    POINTS,
    derivative_row,
    integral,
    integral_powers,
    points,
    quintic,
)
from hexapod_pin.control.footholds import turned
from hexapod_pin.control.stances import LONGEST_PIECE_CYCLES, Stances, stances
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.leg_velocity import joint_rates

if TYPE_CHECKING:
    from hexapod_pin.control.body_motion import TrunkOffset
    from hexapod_pin.control.foot_path import FootPath
    from hexapod_pin.control.six_legs import SixLegs

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

    Attributes:
        marks: where the pieces begin, and the end of the last [s]. L of shape (M + 1,).
        powers: coefficients of s^k, s from -1 to 1 over the piece [m]. L of shape (D, M, 2).
    """

    marks: tuple[Array, ...]
    powers: tuple[Array, ...]

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return d [m] and d' [m/s] at K times inside the table, horizontal. (K, L, 2) each."""
        both = [self._leg(leg, time) for leg in range(len(self.marks))]
        return np.stack([d for d, _ in both], axis=1), np.stack([v for _, v in both], axis=1)

    def _leg(self, leg: int, time: Array) -> tuple[Array, Array]:
        """Return one leg's d and d', (K, 2) each (Horner)."""
        marks, powers = self.marks[leg], self.powers[leg]
        piece = np.clip(np.searchsorted(marks, time, side="right") - 1, 0, len(marks) - 2)
        half = 0.5 * (marks[piece + 1] - marks[piece])
        s = ((time - marks[piece]) / half - 1.0)[:, None]
        d = powers[-1, piece]
        slope = np.zeros_like(d)
        for power in powers[-2::-1]:
            slope = slope * s + d
            d = d * s + power[piece]
        return d, slope / half[:, None]


@lru_cache(maxsize=KEPT_TABLES)
def roll_table(six: SixLegs, path: FootPath, until: float) -> RollTable:
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
    return RollTable(pieces.marks, tuple(tables))


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

    six: SixLegs
    yaw: Array
    p_LF: Array
    twist: Array
    trunk: TrunkOffset | None

    @staticmethod
    def of(six: SixLegs, path: FootPath, pieces: Stances) -> _Rolling:
        """Evaluate the motion of a path's body at the points of the pieces."""
        share = 0.5 * (points() + 1.0)
        count = len(pieces.begin)
        time = (pieces.begin[..., None] + pieces.length[..., None] * share).reshape(count, -1)
        pose, twist = path.body.pose_and_twist(time.ravel())
        pose, twist = pose.reshape(count, -1, 3), twist.reshape(count, -1, 3)
        p_LF = np.repeat(pieces.foothold, POINTS, axis=1)
        p_LF[..., :2] -= pose[..., :2]
        trunk = None if path.motion is None else path.motion.offset(time)
        return _Rolling(six, pose[..., 2], turned(p_LF, -pose[..., 2]), twist, trunk)

    def rate(self, d: Array) -> Array:
        """Return d' [m/s] of displacements d [m] in the world. Shapes (L, M, 2)."""
        legs, radius = self.six.kinematics, self.six.radius[:, None]
        p = self.p_LF + turned(np.concatenate([d, np.zeros_like(d[..., :1])], axis=-1), -self.yaw)
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
        return turned(roll, self.yaw)[..., :2]

    def require_reach(self, d: Array) -> None:
        """Raise ReachError if a leg cannot reach the displaced footholds."""
        p = self.p_LF + turned(np.concatenate([d, np.zeros_like(d[..., :1])], axis=-1), -self.yaw)
        self.six.kinematics.inverse(p if self.trunk is None else self.trunk.into(p))


def _solve(rolling: _Rolling, pieces: Stances, until: float) -> tuple[Array, Array]:
    """Return d' at the points (L, P, POINTS, 2) [m/s] and d where each piece begins (L, P, 2) [m].

    Pieces after `until` [s] only say where swings lead to: out of reach they do not roll.

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
