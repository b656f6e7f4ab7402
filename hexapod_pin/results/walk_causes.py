"""Joint limits, slip and lag move a run off its plan; the advice names what to change."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import HexapodError
from hexapod_pin.results.joint_budget import LIMITED_TORQUE_SHARE
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.holding_torque import STANDARD_GRAVITY, standing_torque
from hexapod_pin.scene.settings import SceneSettings

LEAST_TRAVEL = 0.05
"""Distance over planned distance below which slip per metre means nothing."""


class JointShare(NamedTuple):
    """The joint that was longest at a limit.

    Attributes:
        joint: its name; empty where no joint ever was.
        share: of the time of the whole run [-].
        joints: how many were there at all.
    """

    joint: str
    share: float
    joints: int


class Slip(NamedTuple):
    """Distance of the contact points on the ground while loaded, per gait cycle (or window).

    Attributes:
        distance: of each foot, by name [m].
        per_metre: the same per metre travelled [m/m]; None where it moves or plans no distance.
    """

    distance: dict[str, float]
    per_metre: dict[str, float] | None

    @property
    def total(self) -> float | None:
        """Of all feet per metre travelled [m/m]."""
        return None if self.per_metre is None else math.fsum(self.per_metre.values())


NEVER = JointShare("", 0.0, 0)


def at_torque_limit(trace: Trace) -> JointShare:
    """Return the joint that was longest at its torque limit, by accepted steps where known."""
    length = float(trace.time[-1] - trace.time[0])
    if trace.limits and length > 0.0:
        times = np.array([row.limit_time for row in trace.limits])
        return _longest(trace.joint_names, times / length)
    if "torque" not in trace.recorded:
        return NEVER
    limit = trace.run.robot.effort(len(trace.joint_names))
    return _sampled(trace, np.abs(trace.torque), limit)


def at_speed_limit(trace: Trace) -> JointShare:
    """Return the joint that was longest at or above the velocity limit of its URDF, by samples."""
    limit = trace.run.robot.velocity(len(trace.joint_names))
    return _sampled(trace, np.abs(trace.v[:, 6:]), limit)


def slip_of(trace: Trace, planned_speed: float) -> Slip | None:
    """Return the slip of a run; None of one that did not gather it.

    Args:
        trace: of the run.
        planned_speed: [m/s].
    """
    summary = trace.gathered
    if summary is None or not np.isfinite(summary.slip_distance).all():
        return None
    path = dict(zip(summary.foot_names, summary.slip_distance.tolist(), strict=True))
    distance = _distance(summary)
    planned = planned_speed * summary.window_time / (summary.cycles or 1)
    if planned <= 0.0 or distance is None or distance <= LEAST_TRAVEL * planned:
        return Slip(path, None)
    return Slip(path, {name: value / distance for name, value in path.items()})


def lag(trace: Trace) -> JointShare:
    """Return the joint with the largest RMS distance from its set-point, as `share` [rad or m]."""
    if "set_points" not in trace.recorded:
        return NEVER
    error = np.sqrt(np.mean((trace.q[:, 7:] - trace.q_ref) ** 2, axis=0))
    return _longest(trace.joint_names, error)


def _distance(summary: Summary) -> float | None:
    """Return the distance per cycle along the heading, without cycles between both ends [m]."""
    if summary.cycles:
        return summary.distance
    if len(summary.path) < 2:
        return None
    return float(np.linalg.norm(summary.path[-1, 1:3] - summary.path[0, 1:3]))


def _sampled(trace: Trace, size: Array, limit: Array) -> JointShare:
    """Return the joint that is at a limit at most samples; a limit of 0 is none."""
    least = np.where(limit > 0.0, LIMITED_TORQUE_SHARE * limit, np.inf)
    return _longest(trace.joint_names, np.mean(size >= least, axis=0))


def _longest(names: tuple[str, ...], shares: Array) -> JointShare:
    if not len(names) or not np.any(shares > 0.0):
        return NEVER
    worst = int(np.argmax(shares))
    return JointShare(names[worst], float(shares[worst]), int(np.count_nonzero(shares)))


# What to change where a robot does not walk.

RESERVE = 1.5
"""Effort over what standing on the fewest feet takes, that is advised (*assumed*)."""

MUCH_LIMITED = 0.05
"""Share of the time at a limit from which it is taken for the cause."""

MUCH_SLIP = 0.2
"""Slip of all feet per metre travelled from which it is taken for the cause [m/m]."""

MUCH_SLIP_PATH = 0.01
"""The same of a robot that does not move or plans no distance: of all feet per cycle [m]."""

MUCH_LAG = 0.05
"""RMS distance of a joint from its set-point from which it is taken for the cause [rad]."""


class StaticNeed(NamedTuple):
    """What standing takes of the joint that has least effort for it.

    Attributes:
        joint: its name.
        torque: static, on the fewest feet [N m].
        effort_limit: its torque limit [N m].
    """

    joint: str
    torque: float
    effort_limit: float


def static_need(trace: Trace) -> StaticNeed | None:
    """Return what standing takes of the most loaded joint; None where the trace has no robot."""
    try:
        recorded = RecordedRobot.of(trace)
        torque = np.array(standing_torque(recorded.robot))
    except HexapodError:
        return None
    gravity = float(np.linalg.norm(recorded.gravity))
    torque *= recorded.total_mass / recorded.robot.total_mass * gravity / STANDARD_GRAVITY
    known = trace.run.robot
    limit = recorded.robot.effort_limit if known.effort_limit is None else known.effort(len(torque))
    if not torque.size or not torque.any():
        return None
    share = np.divide(torque, limit, where=limit > 0.0, out=np.full(len(torque), np.inf))
    worst = int(np.argmax(np.where(torque > 0.0, share, 0.0)))
    return StaticNeed(trace.joint_names[worst], float(torque[worst]), float(limit[worst]))


def advice(
    trace: Trace, *, at_start: bool, torque: JointShare, speed: JointShare, slip: Slip | None,
    lag: JointShare,
) -> str:  # fmt: skip
    """Return what to change, by the first of the causes that shows.

    Args:
        trace: of the run.
        at_start: whether the trunk lies on the ground from the start.
        torque: the joint longest at its torque limit.
        speed: the same at its velocity limit.
        slip: of the feet.
        lag: the joint farthest from its set-point.
    """
    if at_start:
        return "the trunk lies on the ground as the robot stands: choose a higher posture"
    prescribed = trace.run.prescribed
    need = None if prescribed else static_need(trace)
    if need is not None and need.torque > need.effort_limit:
        return (
            f"effort is too small for its weight: standing on the fewest feet takes "
            f"{need.torque:.3g} N m at {need.joint}, which has {need.effort_limit:.3g}: give it "
            f"{RESERVE * need.torque:.2g} N m or more, or make the robot lighter"
        )
    cycle = trace.run.walk.cycle_time
    longer = (
        "a longer cycle" if cycle is None else f"a longer cycle than {cycle:.3g} s (--cycle-time)"
    )
    if torque.share >= MUCH_LIMITED and not prescribed:
        limit = trace.run.robot.effort(len(trace.joint_names))[trace.joint(torque.joint)]
        stands = "" if need is None else (
            f", standing on the fewest feet takes {need.torque:.3g} N m at {need.joint}"
        )  # fmt: skip
        return (
            f"{torque.joint} is at its torque limit of {limit:.3g} N m for {torque.share:.0%} of "
            f"the time{stands}: more effort, less weight, or {longer}"
        )
    if speed.share >= MUCH_LIMITED:
        return f"{speed.joint} is at its velocity limit for {speed.share:.0%} of the time: {longer}"
    if lag.share >= MUCH_LAG and not prescribed:
        return f"{lag.joint} is {lag.share:.2g} rad from its set-point (RMS): stiffer servos (--kp)"
    if slip is not None and _slips(slip):
        much = "" if slip.total is None else f" {slip.total:.2g} m per m travelled"
        return f"feet slip{much}: a larger friction coefficient{_mu(trace.run.scene)}, or {longer}"
    return f"try {longer}, a shorter stroke (--stroke), or more feet on the ground (--gait wave)"


def _slips(slip: Slip) -> bool:
    """Return whether slip explains that a robot moves or turns too little."""
    if slip.total is None:
        return math.fsum(slip.distance.values()) >= MUCH_SLIP_PATH
    return slip.total >= MUCH_SLIP


def _mu(scene: SceneSettings | None) -> str:
    """Return the run's friction coefficient as text, where its scene is known."""
    if scene is None:
        return ""
    friction = scene.contact.friction
    mu = getattr(friction, "mu", getattr(friction, "mu_static", None))
    return "" if mu is None else f" than {mu:.3g} (--mu)"
