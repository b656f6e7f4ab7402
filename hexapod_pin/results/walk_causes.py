"""Joint limits, slip and lag move a run off its plan; the advice names what to change."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import HexapodError
from hexapod_pin.results.ground_obstacle import (
    UPWARDS,
    find_obstacle,
    gravity_doubt,
    sinking,
)
from hexapod_pin.results.joint_budget import LIMITED_TORQUE_SHARE
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.run_record import RunRecord
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.travelled_path import PushEffect
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
    return Slip(path, slip_per_metre(summary, planned_speed))


def slip_per_metre(summary: Summary, planned_speed: float) -> dict[str, float] | None:
    """Return the slip of each foot per metre travelled [m/m]; None where it moves or plans none.

    Args:
        summary: of the run.
        planned_speed: [m/s].
    """
    distance = _distance(summary)
    planned = planned_speed * summary.window_time / (summary.cycles or 1)
    if planned <= 0.0 or distance is None or distance <= LEAST_TRAVEL * planned:
        return None
    sizes = zip(summary.foot_names, summary.slip_distance.tolist(), strict=True)
    return {name: value / distance for name, value in sizes if math.isfinite(value)}


DRAGGED = 0.8
"""Slip of a foot per metre travelled from which it is dragged: it never stands (*assumed*)."""


def dragged_feet(slip: Mapping[str, float] | None) -> list[str]:
    """Return the feet that are dragged, by their slip per metre travelled [m/m]."""
    return [name for name, size in (slip or {}).items() if size >= DRAGGED]


def dragging(slip: Mapping[str, float] | None, lost: int) -> str:
    """Return which feet a robot drags along, more than it has legs without torque; else nothing.

    Args:
        slip: of each foot per metre travelled [m/m]; None where it is not known.
        lost: legs without torque, which can only be dragged.
    """
    names = dragged_feet(slip)
    return f"it drags {' and '.join(names)} along" if len(names) > lost else ""


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

RELEVANT = 0.05
"""Static torque over the largest of any joint from which it is looked at [-]."""

RESERVE = 1.5
"""Effort over what standing on the fewest feet takes, that is advised (*assumed*)."""

LEAST_FRICTION = 0.02
"""Friction coefficient below which no robot walks: the least of any sole on ice [-] (*assumed*)."""

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
    heavy = torque >= RELEVANT * torque.max()  # the others are rounding, or nearly
    share = np.where(heavy, share, 0.0)
    worst = int(np.argmax(np.where(share == share.max(), torque, 0.0)))
    return StaticNeed(trace.joint_names[worst], float(torque[worst]), float(limit[worst]))


class Advice(NamedTuple):
    """What to change where a robot does not walk.

    Attributes:
        cause: why it does not walk, in a few words.
        text: what to change, in words, with the option of `walk`.
        change: the field of the gait and its value, where a run can try it; None where not.
    """

    cause: str
    text: str
    change: tuple[str, float] | None = None


NO_ADVICE = Advice("", "")

LONGER = 1.5
"""A cycle that is tried over that of the run [-]."""


def advice(
    trace: Trace, *, at_start: bool, torque: JointShare, speed: JointShare, slip: Slip | None,
    lag: JointShare, push: PushEffect | None = None,
) -> Advice:  # fmt: skip
    """Return what to change, by the first of the causes that shows.

    The robot's weight and the ground come first: what they do shows in torques and slip, too.

    Args:
        trace: of the run.
        at_start: whether the trunk lies on the ground from the start.
        torque: the joint longest at its torque limit.
        speed: the same at its velocity limit.
        slip: of the feet.
        lag: the joint farthest from its set-point.
        push: what pushes did.
    """
    if (pull := gravity_doubt(trace.run.gravity)).startswith(UPWARDS):
        return Advice(pull, f"{pull}: gravity = (0, 0, -9.81) m/s^2 points down")
    if at_start:
        return Advice(
            "its trunk lies on the ground",
            "the trunk lies on the ground as the robot stands: choose a higher posture",
        )
    if (mu := friction_coefficient(trace.run.scene)) is not None and mu < LEAST_FRICTION:
        return Advice(
            f"friction of {mu:.2g} holds no foot",
            f"no sole has so little friction, on ice neither: a larger friction coefficient"
            f"{_mu(trace.run.scene)}",
        )
    prescribed = trace.run.prescribed
    need = None if prescribed else static_need(trace)
    if need is not None and need.torque > need.effort_limit and torque.joints:
        return Advice(
            f"{need.joint} is too weak to stand: {need.effort_limit:.3g} of {need.torque:.3g} N m",
            f"effort is too small for its weight: standing on the fewest feet takes "
            f"{need.torque:.3g} N m at {need.joint}, which has {need.effort_limit:.3g}: give it "
            f"{RESERVE * need.torque:.2g} N m or more, or make the robot lighter",
        )
    if (by_load := _load_advice(trace, push)) is not None:
        return by_load
    if (found := _ground_advice(trace) or _payload_advice(trace)) is not None:
        return found
    cycle = trace.run.walk.cycle_time
    longer = (
        "a longer cycle" if cycle is None else f"a longer cycle than {cycle:.3g} s (--cycle-time)"
    )
    change = None if cycle is None else ("cycle_time", LONGER * cycle)
    if torque.share >= MUCH_LIMITED and not prescribed:
        limit = trace.run.robot.effort(len(trace.joint_names))[trace.joint(torque.joint)]
        stands = "" if need is None else (
            f", standing on the fewest feet takes {need.torque:.3g} N m at {need.joint}"
        )  # fmt: skip
        return Advice(
            f"{torque.joint} is at its torque limit {torque.share:.0%} of the time",
            f"{torque.joint} is at its torque limit of {limit:.3g} N m for {torque.share:.0%} of "
            f"the time{stands}: more effort, less weight, or {longer}",
            change,
        )
    if speed.share >= MUCH_LIMITED:
        text = f"{speed.joint} is at its velocity limit for {speed.share:.0%} of the time: {longer}"
        cause = f"{speed.joint} is at its velocity limit {speed.share:.0%} of the time"
        return Advice(cause, text, change)
    if lag.share >= MUCH_LAG and not prescribed:
        text = f"{lag.joint} is {lag.share:.2g} rad from its set-point (RMS): stiffer servos (--kp)"
        return Advice(f"{lag.joint} is {lag.share:.2g} rad from its set-point (RMS)", text)
    if slip is not None and _slips(slip):
        much = "" if slip.total is None else f" {slip.total:.2g} m per m travelled"
        return Advice(
            f"its feet slip{much}",
            f"feet slip{much}: a larger friction coefficient{_mu(trace.run.scene)}, or {longer}",
            change,
        )
    return Advice(
        "",
        f"try {longer}, a shorter stroke (--stroke), or more feet on the ground (--gait wave)",
        change,
    )


STRONG_PUSH = 0.5
"""Force of a push over the weight, from which it is taken for the cause [-] (*assumed*)."""


def lost_legs(trace: Trace) -> tuple[str, ...]:
    """Return the legs whose drives give no torque, from some time of a run on."""
    return legs_lost(trace.run, float(trace.time[-1]))


def legs_lost(run: RunRecord, end: float) -> tuple[str, ...]:
    """Return the legs of a run whose drives give no torque, from some time before its end on."""
    from hexapod_pin.scene.loads import LostLeg

    loads = () if run.scene is None else run.scene.loads
    return tuple(one.leg for one in loads if isinstance(one, LostLeg) and one.start < end)


def _load_advice(trace: Trace, push: PushEffect | None) -> Advice | None:
    """Return what to change where legs are lost, or the robot is pushed hard."""
    lost = lost_legs(trace)
    if lost:
        names = f"leg{'s' * (len(lost) > 1)} {' and '.join(lost)}"
        have, give = ("has", "gives") if len(lost) == 1 else ("have", "give")
        return Advice(
            f"{names} {have} no drive torque",
            f"a gait counts on {names}, which {give} no torque: one that has more feet on the "
            "ground at a time (--gait wave)",
        )
    weight = float(np.linalg.norm(trace.run.gravity)) * trace.run.robot.mass
    force = 0.0 if push is None else push.force
    if push is not None and (push.thrown or force > STRONG_PUSH * weight):
        threw = f", threw it {push.offset:.3g} m off its track" if push.thrown else ""
        if not force:
            weaker = "a weaker or shorter push, or a lower, wider posture"
            return Advice(f"a push by a torque{threw}", weaker)
        size = f"{force:.0f} N" if force >= 1000.0 else f"{force:.3g} N"
        return Advice(
            f"a push of {size}, {force / weight:.2g} times its weight{threw}",
            f"the push of {size} is {force / weight:.2g} times the robot's weight of "
            f"{weight:.3g} N: a weaker or shorter one, or a lower, wider posture",
        )
    return None


HEAVY_PAYLOAD = 0.5
"""Mass of payloads over that of the robot, from which they are taken for the cause [-]
(*assumed*)."""


def _payload_advice(trace: Trace) -> Advice | None:
    """Return what to change where a robot carries much; None where it does not."""
    from hexapod_pin.scene.loads import Payload

    loads = () if trace.run.scene is None else trace.run.scene.loads
    carried = [one for one in loads if isinstance(one, Payload)]
    mass = math.fsum(one.mass for one in carried)
    own = trace.run.robot.mass - mass
    if not 0.0 < HEAVY_PAYLOAD * own <= mass:
        return None
    where = f"{mass:.3g} kg on {' and '.join(dict.fromkeys(one.link for one in carried))}"
    return Advice(
        f"a payload of {where}, {mass / own:.2g} times its mass",
        f"it carries {where}: less, or nearer to the middle of the trunk",
    )


def _ground_advice(trace: Trace) -> Advice | None:
    """Return what to change where the ground is higher than the lift, or too steep for friction."""
    obstacle = find_obstacle(trace)
    if obstacle is not None and not obstacle.is_cleared:
        lift = obstacle.advised_lift
        return Advice(
            f"the ground is {1e3 * obstacle.height:.0f} mm high, its lift "
            f"{1e3 * obstacle.lift:.0f} mm",
            f"the ground rises {1e3 * obstacle.height:.3g} mm above the line between footholds "
            f"{obstacle.distance:.2g} m ahead, and swing feet lift by {1e3 * obstacle.lift:.3g} "
            f"mm: lift them by {1e3 * lift:.3g} mm (--lift {lift:g})",
            ("lift", lift),
        )
    if (sunk := sinking(trace)) is not None:
        return Advice(
            f"its feet sink {1e3 * sunk.depth:.3g} mm into the ground",
            f"a third of its weight pushes a foot {1e3 * sunk.depth:.3g} mm into the ground, and "
            f"swing feet lift by {1e3 * sunk.lift:.3g} mm: a stiffer contact than "
            f"{sunk.stiffness:.3g} N/m^{sunk.exponent:g}",
        )
    steepest, mu = _steepest(trace), friction_coefficient(trace.run.scene)
    if mu is not None and steepest > math.atan(mu):
        return Advice(
            f"{math.degrees(steepest):.3g} degrees are too steep for friction of {mu:.3g}",
            f"the ground under its feet slopes by {math.degrees(steepest):.3g} degrees, and "
            f"friction of {mu:.3g} holds up to {math.degrees(math.atan(mu)):.3g}: a less steep way",
        )
    return None


def _steepest(trace: Trace) -> float:
    """Return the steepest slope under loaded feet at samples [rad]; 0 where it is not known."""
    if "contacts" not in trace.recorded:
        return 0.0
    gravity = np.array(trace.run.gravity)
    size = float(np.linalg.norm(gravity))
    loaded = np.linalg.norm(trace.foot_force, axis=-1) > 0.0
    if size == 0.0 or not loaded.any():
        return 0.0
    upright = (trace.foot_normal[loaded] @ -gravity) / size
    return math.acos(min(1.0, max(-1.0, float(np.median(upright)))))


def _slips(slip: Slip) -> bool:
    """Return whether slip explains that a robot moves or turns too little."""
    if slip.total is None:
        return math.fsum(slip.distance.values()) >= MUCH_SLIP_PATH
    return slip.total >= MUCH_SLIP


def _mu(scene: SceneSettings | None) -> str:
    """Return the run's friction coefficient as text, where its scene is known."""
    mu = friction_coefficient(scene)
    return "" if mu is None else f" than {mu:.3g} (--mu)"


def friction_coefficient(scene: SceneSettings | None) -> float | None:
    """Return the friction coefficient of a scene's feet; None where it is not known."""
    if scene is None:
        return None
    friction = scene.contact.friction
    mu = getattr(friction, "mu", getattr(friction, "mu_static", None))
    return None if mu is None else float(mu)
