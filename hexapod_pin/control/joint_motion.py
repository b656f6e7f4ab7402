"""Joints follow given functions of time, checked against their ranges and velocity limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.control.curves import MotionFunction
from hexapod_pin.control.joint_trajectory import (
    JointTrajectory,
    check_duration,
    extremes,
    quintic_control_points,
    slopes,
    whole_cycles,
)
from hexapod_pin.control.knot_table import knot_times
from hexapod_pin.control.time_function import TimeFunction
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.leg_geometry import ANGLE_TOLERANCE
from hexapod_pin.spec import degrees_meant, parameter_error

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


LONGEST_INTERVAL = 1.0
"""Its multiples are knots, so that those of a shorter plan begin those of a longer one [s]."""

INTERVALS_PER_PIECE = 18
"""Intervals in a `shortest_time`, a quarter of a sine's period.

The quintic between knots h apart misses a sine of amplitude a by at most a (w h)^6 / 46080, with
w h = 2 pi / 72: 1e-11 a.
"""

SAME_KINK = 1e-9
"""Kinks closer than this are one: they are the same time, rounded in two ways [s]."""

MAX_KNOTS = 1_000_000

REPEAT_TOLERANCE = 1e-9
"""Largest difference from one cycle to the next of a motion with a cycle time [rad]."""

_FUNCTION: TypeAdapter[Any] = TypeAdapter(TimeFunction)


@checked(but="motion")
@dataclass(frozen=True)
class JointMotion:
    """Joints move as given functions of time; the others keep their standing angles.

    Attributes:
        motion: from joint name to its angle, a number or a function of time [rad]: `Step`, `Step5`,
            `Havsin`, `VelocityStep`, `Sine`, `Waypoints`, `Hermite`, `Sum`, `Periodic`.
        cycle_time: with which the motion repeats, so that a summary covers whole cycles [s];
            None: it does not repeat.
        steady_from: time from which it repeats [s].
        speed: nominal speed straight ahead of the walk that this is, if it is one [m/s].

    Raises:
        ParameterError: a value is neither a finite number nor a function of time, or a time is out
            of range.

    Example:
        >>> lift = hp.motion.Step(start=0.5, end=1.0, initial=0.0, final=0.1)
        >>> plan = hp.motion.JointMotion({"lf_coxa_joint": lift}).plan(robot, 2.0)
    """

    motion: Mapping[str, float | MotionFunction]
    cycle_time: float | None = field(default=None, kw_only=True)
    steady_from: float = field(default=0.0, kw_only=True)
    speed: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        """Make a checked copy of the functions."""
        joints = isinstance(self.motion, Mapping) and all(isinstance(j, str) for j in self.motion)
        if not joints:
            raise ParameterError("JointMotion.motion", self.motion, "from joint name to function")
        own = {joint: _checked(joint, given) for joint, given in self.motion.items()}
        object.__setattr__(self, "motion", own)
        if self.cycle_time is not None and not 0.0 < self.cycle_time < np.inf:
            raise ParameterError("JointMotion.cycle_time", self.cycle_time, "finite and above 0 s")
        for name, unit in (("steady_from", "s"), ("speed", "m/s")):
            if not 0.0 <= getattr(self, name) < np.inf:
                value = getattr(self, name)
                raise ParameterError(f"JointMotion.{name}", value, f"finite, 0 {unit} or more")

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the reference: quintics through position, rate and acceleration at the knots.

        Every kink of a function is a knot, with the acceleration on either side. Polynomials up to
        degree 5 are followed exactly, sines to 1e-11 of their amplitude. The last knot is after the
        end, and the knots of a shorter plan begin those of a longer one.

        Raises:
            UnknownNameError: the robot has no joint of that name.
            ParameterError: the duration, a joint beyond its range or velocity limit, a motion that
                does not repeat with its cycle time, or one that needs more than MAX_KNOTS knots.
        """
        end = check_duration(duration)
        columns = {robot.joint_index(joint): one for joint, one in self.motion.items()}
        time = self._knots(end)
        q, v = np.tile(robot.posture, (len(time), 1)), np.zeros((len(time), len(robot.posture)))
        acceleration = np.zeros((len(time) - 1, 2, len(robot.posture)))
        ends = np.stack([time[:-1], time[1:]], axis=-1)
        inside = np.broadcast_to(ends.mean(axis=-1, keepdims=True), ends.shape)
        for column, one in columns.items():
            if not isinstance(one, MotionFunction):
                q[:, column] = one
                continue
            q[:, column], v[:, column] = one.value_and_rate(time)
            acceleration[..., column] = one.acceleration(ends, inside)
        self._check_repeats(time, end)
        period = self.cycle_time
        cycles = 0.0 if period is None else whole_cycles(max(0.0, end - self.steady_from), period)
        plan = JointTrajectory(
            time=time,
            q=q,
            v=v,
            cycle_time=period,
            steady_from=self.steady_from,
            steady_until=end if period is None else self.steady_from + cycles,
            travel_direction=np.array([1.0, 0.0]),
            speed=self.speed,
            kind="quintic",
            acceleration=acceleration,
        )
        refuse_beyond_limits(robot, plan, "JointMotion")
        return plan

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        settings: dict[str, Any] = {"kind": "joint-motion"}
        if self.cycle_time is not None:
            settings["cycle_time"] = self.cycle_time
        for name in ("steady_from", "speed"):
            if getattr(self, name):
                settings[name] = getattr(self, name)
        motion = {
            joint: one.model_dump(mode="json") if isinstance(one, MotionFunction) else one
            for joint, one in self.motion.items()
        }
        return {**settings, "motion": motion}

    @property
    def _functions(self) -> list[MotionFunction]:
        return [one for one in self.motion.values() if isinstance(one, MotionFunction)]

    def _knots(self, end: float) -> Array:
        """Return the knot times, from 0 to the first whole LONGEST_INTERVAL after the end [s]."""
        last = (np.floor((end + SAME_KINK) / LONGEST_INTERVAL) + 1.0) * LONGEST_INTERVAL
        spacing = min((one.shortest_time for one in self._functions), default=np.inf)
        spacing = min(spacing / INTERVALS_PER_PIECE, LONGEST_INTERVAL)
        kinks = [kink for one in self._functions for kink in one.kinks_until(float(last))]
        count = last / spacing + len(kinks)
        if count > MAX_KNOTS:
            raise ParameterError(
                "JointMotion.plan.duration", end, f"shorter: it takes {count:.3g} knots, of which "
                f"there can be {MAX_KNOTS}", "Slower sines and repetitions take fewer knots.",
            )  # fmt: skip
        whole = np.arange(last / LONGEST_INTERVAL + 0.5) * LONGEST_INTERVAL
        own = np.array(kinks, dtype=float)
        own = own[(own > 0.0) & (own < last)]
        nearest = np.round(own / LONGEST_INTERVAL) * LONGEST_INTERVAL
        events = np.unique(np.concatenate([whole, own[np.abs(own - nearest) > SAME_KINK]]))
        events = events[np.diff(events, prepend=-np.inf) > SAME_KINK]
        return knot_times(events, spacing)[0]

    def _check_repeats(self, time: Array, end: float) -> None:
        """Refuse a cycle time with which the functions do not repeat, as far as the plan goes."""
        if self.cycle_time is None:
            return
        time = time[(time >= self.steady_from) & (time + self.cycle_time <= end)]
        for joint, one in self.motion.items():
            if not isinstance(one, MotionFunction) or not len(time):
                continue
            now, later = (one.value_and_rate(t)[0] for t in (time, time + self.cycle_time))
            worst = int(np.argmax(np.abs(later - now)))
            if abs(later[worst] - now[worst]) > REPEAT_TOLERANCE:
                raise ParameterError(
                    "JointMotion.cycle_time", self.cycle_time,
                    f"a period of the motion: {joint} is at {now[worst]:.6g} rad at t = "
                    f"{time[worst]:.4g} s and one cycle later at {later[worst]:.6g} rad",
                    "steady_from is the time from which the motion repeats.",
                )  # fmt: skip


def _checked(joint: Any, given: Any) -> Any:
    """Return a number or function, made of plain data where it is that.

    Raises:
        ParameterError: it is neither.
    """
    try:
        return _FUNCTION.validate_python(given)
    except ValidationError as error:
        raise parameter_error(f"JointMotion.motion[{joint}]", error, given) from error


# Whether a quintic joint trajectory stays within the joints' ranges and velocity limits.

RATE_TOLERANCE = 1e-9
"""Share of a velocity limit by which a rate may exceed it."""


def refuse_beyond_limits(robot: Robot, plan: JointTrajectory, owner: str) -> None:
    """Check the exact extremes of angles and rates of a plan of kind "quintic".

    The Bernstein coefficients enclose the polynomials; extremes are searched for only in intervals
    in which they do not decide.

    Raises:
        ParameterError: naming the first joint beyond a limit, the time and the value.
    """
    angle = quintic_control_points(plan)
    rate = slopes(angle, np.diff(plan.time))
    bounds = (robot.lower - ANGLE_TOLERANCE, robot.upper + ANGLE_TOLERANCE)
    found = _first_beyond(plan.time, angle, *bounds)
    if found is not None:
        joint, when, value = found
        raise ParameterError(
            f"{owner}.q[{robot.joint_names[joint]}]", value,
            f"{robot.lower[joint]:.4f} to {robot.upper[joint]:.4f} rad at t = {when:.4g} s",
            degrees_meant(value, robot.lower[joint], robot.upper[joint]),
        )  # fmt: skip
    limit = robot.velocity_limit * (1.0 + RATE_TOLERANCE)
    found = _first_beyond(plan.time, rate, -limit, limit)
    if found is not None:
        joint, when, value = found
        raise ParameterError(
            f"{owner}.v[{robot.joint_names[joint]}]", value,
            f"-{robot.velocity_limit[joint]:g} to {robot.velocity_limit[joint]:g} rad/s "
            f"at t = {when:.4g} s",
        )  # fmt: skip


def _first_beyond(
    time: Array, points: Array, lower: Array, upper: Array
) -> tuple[int, float, float] | None:
    """Return joint, time [s] and value of the farthest point beyond bounds in the first interval.

    Args:
        time: knots [s]. Shape (K,).
        points: Bernstein coefficients. Shape (D + 1, K - 1, n).
        lower: least values. Shape (n,).
        upper: largest values. Shape (n,).
    """
    doubtful = (points.max(axis=0) > upper) | (points.min(axis=0) < lower)
    for interval, joint in np.argwhere(doubtful):
        at, value = extremes(points[:, interval, joint])
        beyond = np.maximum(lower[joint] - value, value - upper[joint])
        worst = int(np.argmax(beyond))
        if beyond[worst] > 0.0:
            when = time[interval] + at[worst] * (time[interval + 1] - time[interval])
            return int(joint), float(when), float(value[worst])
    return None
