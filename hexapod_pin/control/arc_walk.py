"""[S2]'s walk: in stance only the coxae turn, at a constant rate or in one STEP, and feet scrub."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.control.arc_path import ArcPath, StanceProfile
from hexapod_pin.control.arc_refusal import refuse_impossible_arc
from hexapod_pin.control.foot_path import EVENT_SEPARATION_CYCLES
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import JointTrajectory, check_duration, whole_cycles
from hexapod_pin.control.knot_table import MAX_KNOT_SPACING, knot_times
from hexapod_pin.control.six_legs import require_six_of_three
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

PAPER_AMPLITUDE = float(np.radians(20.0))
"""[S2]: +-20 degrees, a stroke of 0.139 m with kharagpur's legs (printed: 0.14 m)."""

PAPER_LIFT = float(np.radians(6.0))
"""[S2]: the femur rises by 6 degrees in swing, the foot by 13 mm with kharagpur's legs."""

LARGEST_ANGLE = 0.5 * np.pi


@checked
@dataclass(frozen=True)
class ArcWalk:
    """Walk straight ahead open loop as [S2] does: legs turn about their yaw axes, feet on arcs.

    Straight ahead a stance foot on an arc slides sideways by R (1 - cos A), twice a stance: 12.2 mm
    for kharagpur. `KinematicControl` is the walk without it.

    Attributes:
        gait: order, duty and cycle time of the steps; default [S2]'s tetrapod in 2.4 s. Its stroke
            and lift are not used: those of the arcs are in `path(robot).gait`.
        amplitude: A, of the coxae to either side of the standing direction [rad].
        lift_angle: of the femora in swing [rad].
        profile: of the coxae in stance: "constant" rate, or one ADAMS "step" from end to end, with
            which legs that are not in step push against each other.
        stop_at: time at which the robot stands still again [s]; None walks to the end.

    Raises:
        ParameterError: an angle or the profile is out of range, or the gait turns or goes sideways.

    Example:
        >>> trace = hp.simulate(hp.Scene(hp.load_robot("kharagpur")), ArcWalk(), duration=10.0)
    """

    gait: Gait = field(default_factory=Gait.tetrapod)
    amplitude: float = field(default=PAPER_AMPLITUDE, kw_only=True)
    lift_angle: float = field(default=PAPER_LIFT, kw_only=True)
    profile: StanceProfile = field(default="constant", kw_only=True)
    stop_at: float | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Refuse what no robot can do."""
        for name in ("amplitude", "lift_angle"):
            value = getattr(self, name)
            if not 0.0 < value < LARGEST_ANGLE:
                raise ParameterError(f"ArcWalk.{name}", value, "above 0 and below pi/2 rad")
        if self.profile not in get_args(StanceProfile):
            raise ParameterError("ArcWalk.profile", self.profile, '"constant" or "step"')
        for name in ("heading", "turn_rate"):
            if getattr(self.gait, name) != 0.0:
                raise ParameterError(
                    f"ArcWalk.gait.{name}", getattr(self.gait, name), "0",
                    "Arcs go straight ahead; KinematicControl walks anywhere.",
                )  # fmt: skip

    def path(self, robot: Robot) -> ArcPath:
        """Return the planned motion of the feet and of the body.

        Raises:
            GaitError: the robot does not have six three-joint legs that point sideways.
            ParameterError: a stop too early for starting and stopping.
        """
        six = require_six_of_three(robot, "ArcWalk")
        return ArcPath(
            six, six.fitted(self.gait), self.amplitude, self.lift_angle, self.profile, self.stop_at
        )

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the joint reference, after checking that the robot can walk it at all.

        The knots of a shorter walk begin those of a longer one.

        Raises:
            GaitError: joint ranges, joint rates, or legs in each other's way forbid it; `quantity`
                and `limit` say what to change and how far.
            ParameterError: the duration, or a stop too early for starting and stopping.
        """
        end, path = check_duration(duration), self.path(robot)
        six = path.six
        refuse_impossible_arc(robot, path.gait, self.amplitude, self.lift_angle, self.profile)
        period = path.gait.cycle_time
        last = end if self.stop_at is None else min(end, self.stop_at)
        events = np.concatenate([[0.0], path.events(last + 2.0 * period)])
        if self.stop_at is not None:
            events = np.append(events[events < self.stop_at], self.stop_at)
        enough = int(np.searchsorted(events, last - EVENT_SEPARATION_CYCLES * period))
        time = knot_times(events[: enough + 1], MAX_KNOT_SPACING)[0]
        q, v = path.joints(time)
        return JointTrajectory(
            time=time,
            q=six.joint_rows(q, six.posture),
            v=six.joint_rows(v, 0.0),
            cycle_time=period,
            steady_from=path.steady_from,
            steady_until=whole_cycles(min(end, path.steady_until), period),
            travel_direction=path.direction,
            speed=path.speed,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        gait = self.gait.model_dump()
        settings: dict[str, Any] = {
            "kind": "arc", "amplitude": self.amplitude, "lift_angle": self.lift_angle,
            "profile": self.profile,
        }  # fmt: skip
        if self.stop_at is not None:
            settings["stop_at"] = self.stop_at
        lists = {name: list(gait[name]) for name in ("phases", "leg_names") if name in gait}
        return {**settings, "gait": {**gait, **lists}}
