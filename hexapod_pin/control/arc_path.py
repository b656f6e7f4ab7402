"""In [S2]'s motion, stance legs turn about their yaw axes alone and feet move along arcs.

With R the foot's distance from the yaw axis and A the amplitude, a stance foot goes from A ahead of
its standing direction to A behind it: the stroke is 2 R sin A, and on a straight course the foot
has to slide R (1 - cos A) sideways and back. The yaw angle falls at a constant rate, in one ADAMS
STEP, h(s) = s^2 (3 - 2 s), or with a rate that rises by a STEP to a plateau and falls back to 0 by
another one. In swing it returns with h (of the last: by the same rates) while the femur lifts so
in the first half and sets down so in the second; the tibia stays.

A constant rate and h meet with a jump of the rate. It is taken out of the swing: u (1 - u/b)^2
times the stance rate is added where a swing has lasted, or will last, u < b. So the foot lifts off
and touches down with the stance rate, and the joint references are continuously differentiable.

The body starts and stops as in `body_path`; the middle of each stance is the standing direction.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.control.body_path import COINCIDENT, BodyPath, Footholds, WalkSchedule, last_motion
from hexapod_pin.control.curves import RAMP_SHARE, adams_step, velocity_step
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.leg_group import LegGroup
from hexapod_pin.errors import GaitError
from hexapod_pin.immutable import Immutable

StanceProfile = Literal["constant", "step", "velocity-step"]


@dataclass(frozen=True, eq=False)
class ArcPath(WalkSchedule, Immutable):
    """The planned motion of six feet on arcs, relative to a level base at its standing height.

    It has the methods of `FootPath`.

    Attributes:
        six: the legs.
        table: order, duty and cycle time of the steps; its stroke and lift are not used.
        amplitude: A, largest yaw angle from the standing direction [rad].
        lift_angle: largest rise of the femur in swing [rad].
        profile: of the yaw angle in stance: "constant" rate, one "step", or a "velocity-step".
        stop_at: time at which the robot stands still again [s]; None: no stop.
        ramp_share: of a "velocity-step": share of each move in which its rate rises, and again in
            which it falls [-].
        gait: the table with the stroke and the lift that the arcs have on this robot.
        body: the planned motion of the base.
        radius: R of each leg [m]. Shape (6,).

    Raises:
        GaitError: a leg's foot does not move straight ahead about its first joint where the robot
            stands.
        ParameterError: a stop too early for starting and stopping.
    """

    six: LegGroup
    table: Gait
    amplitude: float
    lift_angle: float
    profile: StanceProfile = "constant"
    stop_at: float | None = None
    ramp_share: float = RAMP_SHARE
    gait: Gait = field(init=False, repr=False)
    body: BodyPath = field(init=False, repr=False)
    radius: Array = field(init=False, repr=False)
    _sense: Array = field(init=False, repr=False)
    _times: Footholds = field(init=False, repr=False)
    _halt: float = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Compute radius and sense of each leg, then the body's motion."""
        radius, sense = arc_senses(self.six)
        stroke = 2.0 * float(radius.mean()) * float(np.sin(self.amplitude))
        raised = np.array(self.six.kinematics.posture)
        raised[:, 1] += sense[:, 1] * self.lift_angle
        up = self.six.kinematics.chain.forward(raised[:, None])[:, 0] - self.six.neutral_feet
        gait = self.table.with_changes(stroke=stroke, lift=max(0.0, float(up[:, 2].min())))
        halt = last_motion(gait, self.stop_at)
        body = BodyPath(gait, halt=halt)
        feet = Footholds(gait, self.six.neutral_feet, body)
        for name, value in (
            ("gait", gait), ("body", body), ("radius", radius), ("_sense", sense),
            ("_times", feet), ("_halt", halt),
        ):  # fmt: skip
            object.__setattr__(self, name, value)

    @property
    def periodic(self) -> bool:
        """Whether the paths repeat every cycle from `steady_from` to `steady_until`: they do."""
        return True

    @property
    def speed(self) -> float:
        """Mean speed, 2 R sin A / (duty * cycle_time) with the mean R [m/s]."""
        return self.gait.speed

    @property
    def direction(self) -> Array:
        """Direction of travel. Shape (2,)."""
        return np.array([1.0, 0.0])

    @property
    def stance_rate(self) -> float:
        """Mean yaw rate of the legs in stance, 2 A / (duty * cycle_time) [rad/s]."""
        return 2.0 * self.amplitude / (self.gait.duty * self.gait.cycle_time)

    @property
    def scrub(self) -> float:
        """How far each stance foot has to slide sideways, twice a stance: R (1 - cos A) [m]."""
        return float(self.radius.mean() * (1.0 - np.cos(self.amplitude)))

    def events(self, until: float, since: float = 0.0) -> Array:
        """Return the times in (since, until) at which a second derivative may jump [s]."""
        duty, stance, swing = self.gait.duty, np.zeros(0), SWING_MARKS
        if self.profile == "velocity-step":  # there the third derivative jumps
            ends = np.array([self.ramp_share, 1.0 - self.ramp_share])
            stance, swing = ends, np.concatenate([ends, 0.5 * ends, [0.5], 0.5 + 0.5 * ends])
        marks = [0.0, *(duty * stance), duty, *(duty + (1.0 - duty) * np.sort(swing))]
        return self._events(marks, np.zeros(0), since, until)

    def stance(self, time: ArrayLike) -> NDArray[np.bool_]:
        """Return which feet are planned to be on the ground. Shape (K,) -> (K, 6)."""
        return self._arc(np.asarray(time, dtype=float))[2]

    def joints(self, time: ArrayLike) -> tuple[Array, Array]:
        """Return joint angles [rad] and rates [rad/s] of the legs, (6, K, 3) each."""
        angle, rate, _ = self._arc(np.asarray(time, dtype=float))
        posture = self.six.kinematics.posture[:, None]
        turn = self._sense[:, None] * np.moveaxis(angle, 0, 1)
        return posture + turn, self._sense[:, None] * np.moveaxis(rate, 0, 1)

    def positions_and_velocities(self, time: ArrayLike) -> tuple[Array, Array]:
        """Return foot centres in the base frame [m] and their rates of change [m/s]. (K, 6, 3)."""
        q, v = self.joints(time)
        p, jacobian = self.six.kinematics.chain.forward_and_jacobian(q)
        velocity = (jacobian @ v[..., None])[..., 0]
        return np.swapaxes(p, 0, 1), np.swapaxes(velocity, 0, 1)

    def _turned(self, time: Array) -> Array:
        """Return how far the legs would have turned without stepping [rad]. Shape of `time`."""
        walked = self.body.pose(time.ravel())[:, 0].reshape(time.shape)
        turned: Array = self.stance_rate / self.gait.speed * walked
        return turned

    def _arc(self, time: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return (yaw, lift, 0) angles [rad] and rates [rad/s], (K, 6, 3), and which are down."""
        duty, period = self.gait.duty, self.gait.cycle_time
        phases = np.array(self.gait.phases)
        cycles = time[:, None] / period - phases
        placement = np.floor(cycles)
        age = cycles - placement
        middle, later = self._times.middle(placement), self._times.middle(placement + 1.0)
        here, there = self._turned(middle), self._turned(later)
        moving = (age >= duty) & (np.abs(there - here) > COINCIDENT)
        placed = (placement + phases + np.where(moving | (age < duty), 0.0, 1.0)) * period
        angle, rate = np.zeros((*age.shape, 3)), np.zeros((*age.shape, 3))
        angle[..., 0], rate[..., 0] = self._stance(time, here, placed, middle)
        lifted, touched = placed + duty * period, placed + period
        swing = self._swing(
            (age - duty) / (1.0 - duty),
            (here - self._turned(lifted), there - self._turned(touched)),
            (self._down_rate(lifted), self._down_rate(touched)),
        )
        for total, part in zip((angle, rate), swing, strict=True):
            total[moving] = part[moving]
        return angle, rate, ~moving

    def _stance(
        self, time: Array, here: Array, placed: Array, middle: Array
    ) -> tuple[Array, Array]:
        """Return yaw angle and rate of legs that stand, (K, 6) each.

        Args:
            time: [s]. Shape (K,).
            here: what `_turned` is when the leg is in its standing direction [rad]. Shape (K, 6).
            placed: when the foot was placed [s]. Shape (K, 6).
            middle: middle of the stance, 0 for a leg that stood from the start [s]. Shape (K, 6).
        """
        if self.profile == "constant":
            rate = self._down_rate(time)[:, None]
            return here - self._turned(time)[:, None], np.broadcast_to(rate, here.shape)
        lifted = np.minimum(placed + self.gait.duty * self.gait.cycle_time, self._halt)
        begin = np.where(middle > 0.0, placed, 0.0)
        length = np.maximum(lifted - begin, np.finfo(float).tiny)
        first, travel = here - self._turned(begin), self._turned(begin) - self._turned(lifted)
        h, dh = self._move((time[:, None] - begin) / length)
        return first + travel * h, travel * dh / length

    def _move(self, s: Array) -> tuple[Array, Array]:
        """Return a move from 0 to 1 as the profile has it, and its derivative."""
        if self.profile == "velocity-step":
            return velocity_step(s, self.ramp_share)[:2]
        return adams_step(s)[:2]

    def _down_rate(self, time: Array) -> Array:
        """Return the yaw rate of a leg in stance at constant rate; 0 in a step's ends. (...)."""
        if self.profile != "constant":
            return np.zeros(time.shape)
        forward = self.body.twist(time.ravel())[:, 0].reshape(time.shape)
        rate: Array = -self.stance_rate / self.gait.speed * forward
        return rate

    def _swing(
        self, s: Array, ends: tuple[Array, Array], rates: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """Return (yaw, lift, 0) angles and rates of legs in the air, (K, 6, 3) each.

        Args:
            s: share of the swing that is over; where it is not in 0..1 the leg stands. (K, 6).
            ends: yaw angles of lift-off and touch-down [rad]. Shape (K, 6) each.
            rates: yaw rates there [rad/s]. Shape (K, 6) each.
        """
        length = (1.0 - self.gait.duty) * self.gait.cycle_time
        h, dh = self._move(s)
        up, dup = self._move(1.0 - np.abs(2.0 * s - 1.0))
        first, slope = blend(s)
        last, fall = blend(1.0 - s)
        travel = ends[1] - ends[0]
        yaw = ends[0] + travel * h + length * (rates[0] * first - rates[1] * last)
        yaw_rate = travel * dh / length + rates[0] * slope + rates[1] * fall
        lift_rate = 2.0 * np.sign(0.5 - s) * dup / length
        zero = np.zeros_like(s)
        return (
            np.stack([yaw, self.lift_angle * up, zero], axis=-1),
            np.stack([yaw_rate, self.lift_angle * lift_rate, zero], axis=-1),
        )


# What arcs are made of: the blend of rates, radius and sense of each leg.

BLEND_SHARE = 0.1
"""Share of a swing in which its rate passes from, or to, that of the stance (*assumed*)."""

SWING_MARKS = np.array([BLEND_SHARE, 0.5, 1 - BLEND_SHARE])
"""Shares of a swing at which a second derivative jumps."""

MAX_SKEW = 0.02
"""Largest angle between a foot's motion about its yaw axis and straight ahead [rad], *assumed*."""


def blend(s: Array) -> tuple[Array, Array]:
    """Return s (1 - s/b)^2 inside 0..b, b = BLEND_SHARE, and its derivative: 1 at 0, 0 at b."""
    left = 1.0 - np.clip(s, 0.0, BLEND_SHARE) / BLEND_SHARE
    x = BLEND_SHARE * (1.0 - left)
    return x * left**2, left**2 - 2.0 * x * left / BLEND_SHARE


def arc_senses(six: LegGroup) -> tuple[Array, Array]:
    """Return R (6,) [m] and the signs (6, 3) that move feet ahead (joint 1) and up (joint 2).

    Raises:
        GaitError: a leg does not point straight sideways.
    """
    posture = np.array(six.kinematics.posture)[:, None]
    jacobian = six.kinematics.jacobian(posture)[:, 0]
    about_yaw = jacobian[:, :, 0]
    radius = np.linalg.norm(about_yaw, axis=-1)
    skew = np.arccos(np.clip(np.abs(about_yaw[:, 0]) / np.maximum(radius, COINCIDENT), 0.0, 1.0))
    worst = int(np.argmax(skew))
    if skew[worst] > MAX_SKEW:
        leg = six.legs[worst]
        raise GaitError(
            f"leg {leg.name}: about {leg.joints[0]} the standing foot moves "
            f"{np.degrees(skew[worst]):.3g} deg off straight ahead, at most "
            f"{np.degrees(MAX_SKEW):.3g} deg; an arc walk needs legs that point sideways. "
            "KinematicControl walks with legs of any direction.",
            "posture",
            None,
        )
    sense = np.sign(np.stack([about_yaw[:, 0], jacobian[:, 2, 1], np.zeros(6)], axis=-1))
    return radius, sense
