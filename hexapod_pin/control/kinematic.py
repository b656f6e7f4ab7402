"""Conventional walking: gait -> foot paths -> inverse kinematics -> joint set-points ([S1])."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from hexapod_pin.arguments import checked
from hexapod_pin.control.body_motion import BodyMotion
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.gait_refusal import refuse_impossible, refuse_impossible_command
from hexapod_pin.control.joint_trajectory import JointTrajectory, check_duration, whole_cycles
from hexapod_pin.control.six_legs import six_legs, walking_legs
from hexapod_pin.control.velocity_command import VelocityCommand
from hexapod_pin.control.walk_knots import walk_knots
from hexapod_pin.control.walk_refusal import refuse_impossible_knots, walk_refusal
from hexapod_pin.errors import GaitError, ParameterError, ReachError

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.robot.robot import Robot

__all__ = ["KinematicControl", "refuse_impossible", "walking_legs"]


@checked
@dataclass(frozen=True)
class KinematicControl:
    """Walk a gait open loop: the feet follow `FootPath`, the joints its inverse kinematics.

    Attributes:
        gait: the gait.
        stop_at: time at which the robot stands still again [s]; None walks to the end.
        body: height, sway and tilt of the trunk beside the walk; None: level, at its height. The
            robot starts in the posture that this gives at t = 0, at rest.
        velocity: speed and turn rate that change while walking, in the place of the gait's stroke,
            heading and turn rate; None: those of the gait.

    Raises:
        ParameterError: both a stop and a velocity command (let the command end with zero).
    """

    gait: Gait
    stop_at: float | None = field(default=None, kw_only=True)
    body: BodyMotion | None = field(default=None, kw_only=True)
    velocity: VelocityCommand | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Refuse two ways to stop."""
        if self.stop_at is not None and self.velocity is not None:
            raise ParameterError(
                "stop_at", self.stop_at, "None with a velocity command",
                "End the command with zero speed: the robot then stands still.",
            )  # fmt: skip

    def path(self, robot: Robot) -> FootPath:
        """Return the planned motion of the feet and of the body.

        Raises:
            GaitError: the robot has no legs for this gait.
            ParameterError: a stop too early for starting and stopping.
        """
        return FootPath.of(
            six_legs(robot),
            self.gait,
            stop_at=self.stop_at,
            motion=self.body,
            command=self.velocity,
        )

    def repeats(self, robot: Robot) -> bool:
        """Whether the cycles of the walk repeat, so that `plan_part` can plan it in parts."""
        return self.path(robot).periodic

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the joint reference, after checking that the robot can walk it at all.

        The knots do not depend on the duration: those of a shorter walk begin those of a longer
        one, to the bit where the cycles repeat, and to rounding (1e-12 rad) where the trunk's
        motion or the velocity is a function of time.

        The steady window starts after two whole cycles (`FootPath.steady_from`) and ends with the
        last whole cycle before the end, or before the first leg prepares to stop. A walk whose
        cycles do not repeat has no cycle time and its window is the whole walk.

        Raises:
            GaitError: the robot's legs do not fit the gait, or reach, singularity, joint position
                or joint velocity limits forbid it; `quantity` and `limit` say what to change and
                how far.
            ParameterError: the duration, or a stop too early for starting and stopping.
        """
        end, path = check_duration(duration), self.path(robot)
        if path.periodic:
            return self.plan_part(robot, end, 0.0, end)
        return self._trajectory(path, end, self._unrepeated_knots(robot, path, end))

    def plan_part(
        self, robot: Robot, duration: float, since: float, until: float
    ) -> JointTrajectory:
        """Return a part of what `plan` gives for a walk whose cycles repeat, bit for bit.

        Args:
            robot: who walks.
            duration: of the whole walk [s].
            since: the knots begin at an event of the foot paths not after this time [s].
            until: and go on to one that is not before this [s].

        Raises:
            GaitError, ParameterError: as `plan`.
        """
        if not 0.0 <= since <= until:
            raise ParameterError("since, until", (since, until), "in their order, from 0 s on")
        path = self.path(robot)
        refuse_impossible(robot, self.gait, self.body)
        six = six_legs(robot).along(self.gait, self.velocity)
        return self._trajectory(path, duration, walk_knots(six, path, until, since))

    def _trajectory(
        self, path: FootPath, end: float, knots: tuple[Array, Array, Array]
    ) -> JointTrajectory:
        """Return what the drives follow through knots of a walk of so long [s]."""
        time, q, v = knots
        later = bool(time[0] > 0.0)
        until = whole_cycles(min(end, path.steady_until), self.gait.cycle_time)
        return JointTrajectory(
            time=time,
            q=q,
            v=v,
            is_part=later,
            cycle_time=self.gait.cycle_time if path.periodic else None,
            steady_from=path.steady_from if path.periodic else 0.0,
            steady_until=until if path.periodic else end,
            travel_direction=path.direction,
            speed=path.speed,
            start_pose=None if self.body is None else self.body.start_pose(),
        )

    def _unrepeated_knots(
        self, robot: Robot, path: FootPath, end: float
    ) -> tuple[Array, Array, Array]:
        """Return the knots of a walk whose cycles do not repeat, each of them checked.

        Raises:
            GaitError: naming what fails, and when.
        """
        six = six_legs(robot).along(self.gait, self.velocity)
        try:
            knots = walk_knots(six, path, end)
            refuse_impossible_knots(six, path, *knots)
        except (ReachError, GaitError) as error:
            if self.velocity is not None:
                refuse_impossible_command(robot, self.gait, self.velocity, end)
            if isinstance(error, ReachError):
                raise walk_refusal(six, path, end, error) from None
            raise
        return knots

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        gait = self.gait.model_dump()
        settings: dict[str, Any] = {"kind": "kinematic"}
        if self.stop_at is not None:
            settings["stop_at"] = self.stop_at
        for name in ("body", "velocity"):
            if getattr(self, name) is not None:
                settings[name] = getattr(self, name).model_dump(mode="json")
        lists = {name: list(gait[name]) for name in ("phases", "leg_names") if name in gait}
        return {**settings, "gait": {**gait, **lists}}
