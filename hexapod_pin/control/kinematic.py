"""Conventional walking: gait -> foot paths -> inverse kinematics -> joint set-points ([S1])."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.feasibility import joint_path, neutral_feet, refusal, violation
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import LEG_ORDER, Gait
from hexapod_pin.control.joint_trajectory import JointTrajectory, check_duration
from hexapod_pin.errors import GaitError
from hexapod_pin.robot.leg_kinematics import LegKinematics

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

KNOT_SPACING = 0.01
"""Largest spacing of the knots [s]."""

KNOT_ERROR = 1e-6
"""Largest error of the cubic between knots, in joint angle [rad]."""


@dataclass(frozen=True)
class KinematicControl:
    """Walk a gait open loop: the feet follow `FootPath`, the joints its inverse kinematics.

    Attributes:
        gait: the gait.
        stop_at: time at which the robot stands still again [s]; None walks to the end.
    """

    gait: Gait
    stop_at: float | None = field(default=None, kw_only=True)

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the joint reference, after checking that the robot can walk the gait at all.

        The steady window starts after two whole cycles (`FootPath.steady_from`) and ends with the
        last whole cycle before the end, or before the first leg prepares to stop.

        Raises:
            GaitError: reach, singularity, joint position or joint velocity limits forbid the
                gait; `quantity` and `limit` say what to change and how far.
            ParameterError: the duration, or a stop too early for starting and stopping.
        """
        end = check_duration(duration)
        legs = walking_legs(robot)
        path = FootPath(self.gait, neutral_feet(legs), stop_at=self.stop_at)
        refuse_impossible(robot, self.gait)
        time, q, v = _knots(robot, legs, path, end)
        heading = self.gait.heading
        return JointTrajectory(
            time=time,
            q=q,
            v=v,
            cycle_time=self.gait.cycle_time,
            steady_from=path.steady_from,
            steady_until=_whole_cycles(min(end, path.steady_until), self.gait.cycle_time),
            travel_direction=np.array([np.cos(heading), np.sin(heading)]),
            speed=self.gait.speed,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        gait = self.gait.model_dump()
        settings: dict[str, Any] = {"kind": "kinematic"}
        if self.stop_at is not None:
            settings["stop_at"] = self.stop_at
        return {**settings, "gait": {**gait, "phases": list(gait["phases"])}}


def walking_legs(robot: Robot) -> list[LegKinematics]:
    """Return the six legs in gait order.

    Raises:
        GaitError: the robot does not have six legs.
    """
    names = [leg.name for leg in robot.legs]
    if sorted(names) != sorted(LEG_ORDER):
        raise GaitError(
            f"robot {robot.name} has {len(names)} legs that a gait can move "
            f"({', '.join(names) or 'none'}); a gait needs the six legs {', '.join(LEG_ORDER)}.",
            "legs",
            None,
        )
    return [LegKinematics.of(robot, name) for name in LEG_ORDER]


def refuse_impossible(robot: Robot, gait: Gait) -> None:
    """Check a whole walk, start to stop, before anything runs.

    Raises:
        GaitError: naming leg, joint, value and limit, and the largest request that works.
    """
    legs = walking_legs(robot)
    rows = [[robot.joint_index(joint) for joint in leg.joints] for leg in legs]
    velocity = robot.velocity[np.array(rows)]
    radius = [robot.foot(robot.leg(leg.name).foot).radius for leg in legs]
    soles = neutral_feet(legs)[:, 2] - np.array(radius)
    found = violation(legs, velocity, soles, gait)
    if found is not None:
        raise refusal(found, lambda other: violation(legs, velocity, soles, other) is None, gait)


def _knots(
    robot: Robot, legs: list[LegKinematics], path: FootPath, end: float
) -> tuple[Array, Array, Array]:
    """Return times, angles and rates, halving the spacing until the cubics are close enough."""
    events = np.concatenate([[0.0], path.events(end), [end]])
    spacing = KNOT_SPACING
    while True:
        pieces = np.ceil(np.diff(events) / spacing - 1e-9).astype(int)
        spans = zip(events[:-1], events[1:], pieces, strict=True)
        time = np.concatenate([np.linspace(a, b, n, endpoint=False) for a, b, n in spans] + [[end]])
        middle = 0.5 * (time[:-1] + time[1:])
        both = np.empty(2 * len(time) - 1)
        both[::2], both[1::2] = time, middle
        q, v = _joints(robot, legs, path, both)
        if _midpoint_error(time, q, v) <= 0.5 * KNOT_ERROR:
            return time, q[::2], v[::2]
        spacing *= 0.5


def _midpoint_error(time: Array, q: Array, v: Array) -> float:
    """Return how far the cubics miss the true mid-points, given knots and mid-points in turn."""
    half = 0.125 * np.diff(time)[:, None]
    cubic = 0.5 * (q[:-1:2] + q[2::2]) + half * (v[:-1:2] - v[2::2])
    return float(np.abs(cubic - q[1::2]).max())


def _joints(
    robot: Robot, legs: list[LegKinematics], path: FootPath, time: Array
) -> tuple[Array, Array]:
    """Return angles and rates of all joints, `joint_names` order. Shape (K, n) each."""
    q = np.tile(robot.posture, (len(time), 1))
    v = np.zeros_like(q)
    p_BF, v_BF = path.positions(time), path.velocities(time)
    for index, leg in enumerate(legs):
        rows = [robot.joint_index(joint) for joint in leg.joints]
        q[:, rows], v[:, rows] = joint_path(leg, p_BF[:, index], v_BF[:, index])
    return q, v


def _whole_cycles(time: float, period: float) -> float:
    """Return the last whole cycle not after `time`, but not before 0 [s]."""
    return max(0.0, float(np.floor(time / period + 1e-9)) * period)
