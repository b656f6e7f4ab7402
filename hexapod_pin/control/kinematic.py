"""Conventional walking: gait -> foot paths -> inverse kinematics -> joint set-points ([S1])."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.gait_refusal import refuse_impossible
from hexapod_pin.control.joint_trajectory import JointTrajectory, check_duration
from hexapod_pin.control.six_legs import six_legs, walking_legs
from hexapod_pin.control.walk_knots import walk_knots

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

__all__ = ["KinematicControl", "refuse_impossible", "walking_legs"]


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
        six = six_legs(robot)
        path = FootPath.of(six, self.gait, stop_at=self.stop_at)
        refuse_impossible(robot, self.gait)
        time, q, v = walk_knots(six, path, end)
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


def _whole_cycles(time: float, period: float) -> float:
    """Return the last whole cycle not after `time`, but not before 0 [s]."""
    return max(0.0, float(np.floor(time / period + 1e-9)) * period)
