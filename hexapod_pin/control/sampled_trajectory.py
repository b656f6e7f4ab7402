"""A controller may follow given samples over time, or hold one posture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.control.joint_trajectory import JointTrajectory, TrajectoryKind, check_duration
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.leg_geometry import ANGLE_TOLERANCE
from hexapod_pin.spec import degrees_meant

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


SHORTEST_MOVE = 1e-6
"""Duration of a move of joints without a velocity limit, where others have one [s], *assumed*."""

SAME_TIME = 1e-12
"""Knots closer than this are one [s]."""


@checked
@dataclass(frozen=True)
class SampledTrajectory:
    """Joint set-points as a controller running at a fixed rate sends them.

    A new set-point is a coordinated linear move: all joints leave together and arrive together
    after T = max_j |dq_j| / velocity_j, the URDF's velocity limits, and stay. The next one begins
    where an unfinished move has come to. The rate set-point of the drives is 0 throughout, so they
    lag behind by kd / kp times the joint's rate.

    Attributes:
        time: when each begins, strictly increasing from 0 [s]. Shape (K,).
        q: joint angles, `Robot.joint_names` order [rad]. Shape (K, n). The last one stays.
        limited: False takes set-points as they are, outside the joints' ranges too, and jumps from
            one to the next at once, as if no velocity were limited.
    """

    time: ArrayLike
    q: ArrayLike
    limited: bool = field(default=True, kw_only=True)

    def __post_init__(self) -> None:
        """Make own, hashable copies."""
        time, q = np.asarray(self.time, dtype=float), np.asarray(self.q, dtype=float)
        if time.ndim != 1 or q.ndim != 2 or len(time) != len(q) or not len(time):
            raise ParameterError(
                "SampledTrajectory.time, q",
                (time.shape, q.shape),
                "of shapes (K,) and (K, n), K >= 1",
            )
        object.__setattr__(self, "time", tuple(time.tolist()))
        object.__setattr__(self, "q", tuple(map(tuple, q.tolist())))

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the reference: linear moves, or constant set-points without a velocity limit.

        Raises:
            ParameterError: wrong number of joints, a number not finite or outside its joint's
                range, a joint that is to move and whose velocity limit is 0, or times not
                increasing from 0.
        """
        time, q = np.array(self.time), np.array(self.q)
        if q.shape[1] != len(robot.joint_names):
            raise ParameterError("SampledTrajectory.q", q.shape, f"(K, {len(robot.joint_names)})")
        self._check(robot, ~np.isfinite(q), q)
        kind: TrajectoryKind = "held"
        if self.limited:
            outside = (q < robot.lower - ANGLE_TOLERANCE) | (q > robot.upper + ANGLE_TOLERANCE)
            self._check(robot, outside, q)
            self._check_moves(robot, q)
            moving = np.ptp(q, axis=0) > 0.0
            if np.isfinite(robot.velocity_limit[moving]).any():
                kind, (time, q) = "linear", coordinated_moves(time, q, robot.velocity_limit)
        return JointTrajectory(
            time=time,
            q=q,
            v=np.zeros_like(q),
            cycle_time=None,
            steady_from=0.0,
            steady_until=check_duration(duration),
            travel_direction=np.array([1.0, 0.0]),
            speed=0.0,
            kind=kind,
        )

    def _check(self, robot: Robot, bad: ArrayLike, q: Array) -> None:
        """Refuse the first bad set-point, naming joint, time and range."""
        for knot, joint in np.argwhere(bad):
            where = f"SampledTrajectory.q[{robot.joint_names[joint]}]"
            allowed = f"{robot.lower[joint]:.4f} to {robot.upper[joint]:.4f} rad"
            if not np.isfinite(q[knot, joint]):
                allowed = "finite [rad]"
            allowed += f" at t = {self._begin(knot)}"
            hint = degrees_meant(float(q[knot, joint]), robot.lower[joint], robot.upper[joint])
            raise ParameterError(where, float(q[knot, joint]), allowed, hint)

    def _check_moves(self, robot: Robot, q: Array) -> None:
        """Refuse a move of a joint that cannot turn."""
        still = ~(robot.velocity_limit > 0.0)
        for knot, joint in np.argwhere((np.diff(q, axis=0) != 0.0) & still):
            raise ParameterError(
                f"SampledTrajectory.q[{robot.joint_names[joint]}]",
                float(q[knot + 1, joint]),
                f"{q[knot, joint]:.4f} rad at t = {self._begin(knot + 1)} as before: its velocity "
                f"limit is {robot.velocity_limit[joint]:g} rad/s",
            )

    def _begin(self, knot: int) -> str:
        return f"{float(np.asarray(self.time)[knot]):g} s"

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        return {
            "kind": "held",
            "limited": self.limited,
            "time": np.asarray(self.time).tolist(),
            "q": np.asarray(self.q).tolist(),
        }


def coordinated_moves(time: Array, q: Array, velocity: Array) -> tuple[Array, Array]:
    """Return knots of straight moves to set-points, at the velocity limits of the joints.

    Args:
        time: when each set-point is sent [s]. Shape (K,).
        q: set-points [rad]. Shape (K, n). The first is where the joints are.
        velocity: limits, above 0 for joints that move [rad/s]. Shape (n,).

    Returns:
        Times and angles, at most two knots for a set-point. Shapes (N,) and (N, n).
    """
    times, angles, here = [float(time[0])], [q[0]], q[0]
    slowness = np.where(velocity > 0.0, 1.0 / np.maximum(velocity, np.finfo(float).tiny), 0.0)
    for begin, end, goal in zip(time[1:], np.append(time[2:], np.inf), q[1:], strict=True):
        travel = goal - here
        if not travel.any():
            continue
        needed = max(float(np.max(np.abs(travel) * slowness)), SHORTEST_MOVE)
        if begin - times[-1] > SAME_TIME:
            times.append(float(begin))
            angles.append(here)
        arrive = begin + needed
        finished = arrive <= end + SAME_TIME
        here = goal if finished else here + travel * ((end - begin) / needed)
        times.append(float(min(arrive, end)))
        angles.append(here)
    return np.array(times), np.stack(angles)


# Hold one posture.


@checked
@dataclass(frozen=True)
class HoldPosture:
    """Command constant joint angles.

    Attributes:
        q: joint angles, `Robot.joint_names` order [rad], shape (n,); or a mapping from joint name
            to angle, with the robot's posture for the others; or None for the robot's posture.
    """

    q: ArrayLike | Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        """Make an own copy of the angles."""
        if isinstance(self.q, Mapping):
            own: Any = {str(joint): float(angle) for joint, angle in self.q.items()}
        else:
            own = (
                None
                if self.q is None
                else tuple(np.atleast_1d(np.asarray(self.q, dtype=float)).tolist())
            )
        object.__setattr__(self, "q", own)

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the constant reference.

        Raises:
            ParameterError: wrong number of angles, or one not finite or outside its joint limits.
            UnknownNameError: the mapping names a joint the robot does not have.
        """
        q = self._angles(robot)
        for joint, angle, lower, upper in zip(
            robot.joint_names, q, robot.lower, robot.upper, strict=True
        ):
            if not lower <= angle <= upper:
                raise ParameterError(
                    f"HoldPosture.q[{joint}]", float(angle), f"{lower:.4f} to {upper:.4f} rad",
                    degrees_meant(float(angle), lower, upper),
                )  # fmt: skip
        end = check_duration(duration)
        knots = np.tile(q, (2, 1))
        return JointTrajectory(
            time=np.array([0.0, end]),
            q=knots,
            v=np.zeros_like(knots),
            cycle_time=None,
            steady_from=0.0,
            steady_until=end,
            travel_direction=np.array([1.0, 0.0]),
            speed=0.0,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        if self.q is None:
            return {"kind": "hold"}
        given = self.q if isinstance(self.q, Mapping) else np.asarray(self.q).tolist()
        return {"kind": "hold", "q": given}

    def _angles(self, robot: Robot) -> NDArray[np.float64]:
        """Return the joint angles in `joint_names` order."""
        if self.q is None:
            return np.array(robot.posture)
        if isinstance(self.q, Mapping):
            q = np.array(robot.posture)
            for joint, angle in self.q.items():
                q[robot.joint_index(joint)] = angle
            return q
        q = np.asarray(self.q, dtype=float)
        if q.shape != (len(robot.joint_names),):
            raise ParameterError("HoldPosture.q", q.shape, f"{len(robot.joint_names)} joint angles")
        return q
