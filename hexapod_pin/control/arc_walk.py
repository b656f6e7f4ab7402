"""[S2]'s walk turns only the coxae in stance, so that the feet scrub.

Its motion is also given as functions of time, joint by joint.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.control.arc_path import BLEND_SHARE, ArcPath, StanceProfile, arc_senses
from hexapod_pin.control.body_path import EVENT_SEPARATION_CYCLES
from hexapod_pin.control.curves import (
    RAMP_SHARE,
    Hermite,
    MotionFunction,
    Step,
    VelocityStep,
    adams_step,
)
from hexapod_pin.control.feasibility import (
    CHECKED_CYCLES,
    MAX_FOOT_HEIGHT_SPREAD,
    PATH,
    RATE,
    Violation,
    posture_violation,
)
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.gait_refusal import (
    TOUCHING,
    bisect,
    shortest_working_cycle,
    with_base,
)
from hexapod_pin.control.joint_motion import JointMotion
from hexapod_pin.control.joint_trajectory import JointTrajectory, check_duration, whole_cycles
from hexapod_pin.control.knot_table import MAX_KNOT_SPACING, knot_times
from hexapod_pin.control.leg_group import LegGroup, require_six_of_three
from hexapod_pin.control.time_function import Periodic, Sum
from hexapod_pin.errors import GaitError, ParameterError
from hexapod_pin.robot.leg_bodies import LegBodies, leg_bodies
from hexapod_pin.robot.leg_geometry import ANGLE_TOLERANCE

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
        profile: of the coxae in stance: "constant" rate; one ADAMS "step" from end to end; or
            "velocity-step", a rate that rises by a STEP to a plateau and falls back by another
            one. With the last two, legs that are not in step push against each other, and the
            swing is of the same kind.
        stop_at: time at which the robot stands still again [s]; None: no stop.
        ramp_share: of a "velocity-step": share of each move in which its rate rises, and again in
            which it falls, above 0 and up to 0.5 [-]; the default is *assumed*.

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
    ramp_share: float = field(default=RAMP_SHARE, kw_only=True)

    def __post_init__(self) -> None:
        """Refuse what no robot can do."""
        for name in ("amplitude", "lift_angle"):
            value = getattr(self, name)
            if not 0.0 < value < LARGEST_ANGLE:
                raise ParameterError(f"ArcWalk.{name}", value, "above 0 and below pi/2 rad")
        if self.profile not in get_args(StanceProfile):
            raise ParameterError(
                "ArcWalk.profile", self.profile, '"constant", "step" or "velocity-step"'
            )
        if not 0.0 < self.ramp_share <= 0.5:
            raise ParameterError("ArcWalk.ramp_share", self.ramp_share, "above 0 and up to 0.5")
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
            six, six.fitted(self.gait), self.amplitude, self.lift_angle, self.profile,
            self.stop_at, self.ramp_share,
        )  # fmt: skip

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the joint reference, after checking that the robot can walk it at all.

        The knots of a shorter walk begin those of a longer one.

        Raises:
            GaitError: joint ranges, joint rates, or legs that touch forbid it; `quantity` and
                `limit` are what to change and how far.
            ParameterError: the duration, or a stop too early for starting and stopping.
        """
        end, path = check_duration(duration), self.path(robot)
        six = path.six
        refuse_impossible_arc(robot, path)
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
        settings: dict[str, Any] = {
            "kind": "arc", "amplitude": self.amplitude, "lift_angle": self.lift_angle,
            "profile": self.profile,
        }  # fmt: skip
        if self.profile == "velocity-step":
            settings["ramp_share"] = self.ramp_share
        if self.stop_at is not None:
            settings["stop_at"] = self.stop_at
        return {**settings, "gait": self.gait.to_dict()}


# The refusal of a walk on arcs: what to change in the request, and how far.

CHECK_SPACING_CYCLES = 1.0 / 60.0
"""Largest spacing of the checked times; the extremes of the angles are among them [cycles]."""

NEGLIGIBLE_ANGLE = 1e-4
"""An amplitude or lift that tests the other one alone [rad]."""

CHECKED_WALKS = 64
"""How many checked walks are cached."""


class _Arc(NamedTuple):
    """A walk on arcs of a robot: angles [rad], as of `ArcWalk`."""

    six: LegGroup
    bodies: LegBodies
    gait: Gait
    amplitude: float
    lift_angle: float
    profile: StanceProfile
    ramp_share: float


@lru_cache(maxsize=CHECKED_WALKS)
def _find_refusal(arc: _Arc) -> tuple[str, str, float | None] | None:
    """Return message, quantity and limit of the error that refuses a walk; None if it works."""
    found, gait = _violation(arc), arc.gait
    if found is None:
        return None
    reason = f"arc walk: {found.text}."
    if found.kind == RATE:

        def slower(period: float) -> bool:
            slow = gait.with_changes(cycle_time=period)
            return _violation(arc._replace(gait=slow)) is None

        limit = shortest_working_cycle(slower, gait.cycle_time)
        if limit is not None:
            text = f"{reason} With the rest unchanged, cycle_time must be at least {limit:.4g} s."
            return text, "cycle_time", limit
    for name in ("amplitude", "lift_angle"):
        works, angle = partial(_works, arc, name), getattr(arc, name)
        if angle > NEGLIGIBLE_ANGLE and works(NEGLIGIBLE_ANGLE):
            limit = bisect(works, good=NEGLIGIBLE_ANGLE, bad=angle)
            text = f"{reason} With the rest unchanged, {name} can be at most {limit:.4g} rad."
            return text, name, limit
    return f"{reason} No smaller amplitude or lift angle alone helps.", "posture", None


def _works(arc: _Arc, name: str, angle: float) -> bool:
    """Whether a walk works with another amplitude or lift angle [rad]."""
    changed: dict[str, Any] = {name: angle}
    return _violation(arc._replace(**changed)) is None


def refuse_impossible_arc(robot: Robot, path: ArcPath) -> None:
    """Check a whole walk on arcs of a robot, start to stop, before the run.

    Raises:
        GaitError: naming leg, joint, value and limit, and the largest request that works.
    """
    found = _find_refusal(
        _Arc(
            path.six, leg_bodies(robot), path.six.fitted(path.gait), path.amplitude,
            path.lift_angle, path.profile, path.ramp_share,
        )
    )  # fmt: skip
    if found is not None:
        raise GaitError(*found)


def _violation(arc: _Arc) -> Violation | None:
    """Return why the robot cannot walk, or None if it can."""
    six = arc.six
    if np.ptp(six.soles) > MAX_FOOT_HEIGHT_SPREAD:
        low, high = (six.legs[int(k)].name for k in (np.argmin(six.soles), np.argmax(six.soles)))
        text = f"the standing posture has foot {high} {np.ptp(six.soles):.4f} m above foot {low}"
        return Violation(PATH, text)
    once = arc._replace(gait=arc.gait.in_one_second())
    q, v = _joints(once)
    found = _out_of_range(six, q)
    if found is not None:
        return found
    posture = posture_violation(six, q, v / arc.gait.cycle_time)
    return _touching(once) if posture is None else posture[0]


@lru_cache(maxsize=CHECKED_WALKS)
def _joints(arc: _Arc) -> tuple[Array, Array]:
    """Return joint angles [rad] and rates [rad/s] at the checked times, (6, K, 3) each."""
    gait, end = arc.gait, CHECKED_CYCLES * arc.gait.cycle_time
    path = ArcPath(arc.six, gait, arc.amplitude, arc.lift_angle, arc.profile, end, arc.ramp_share)
    events = np.array([0.0, *path.events(end), end])
    time = knot_times(events, CHECK_SPACING_CYCLES * gait.cycle_time)[0]
    once = path.steady_from + gait.cycle_time  # of the steady part one cycle is enough
    return path.joints(time[(time <= once) | (time >= path.steady_until)])


def _out_of_range(six: LegGroup, q: Array) -> Violation | None:
    """Return the joint that goes farthest beyond its range, joint angles (6, K, 3)."""
    lower, upper = (np.stack([getattr(leg, x) for leg in six.legs]) for x in ("lower", "upper"))
    beyond = np.maximum(lower - q.min(axis=1), q.max(axis=1) - upper)
    if beyond.max() <= ANGLE_TOLERANCE:
        return None
    leg, joint = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    found = six.legs[leg]
    return Violation(
        PATH,
        f"leg {found.name}: joint {found.joints[joint]} would go {beyond[leg, joint]:.4g} rad "
        f"beyond its range {lower[leg, joint]:.4g}..{upper[leg, joint]:.4g} rad",
    )


@lru_cache(maxsize=CHECKED_WALKS)
def _touching(arc: _Arc) -> Violation | None:
    """Return which links overlap most in a walk."""
    bodies = arc.bodies
    if not bodies.pairs:
        return None
    distance, pair = bodies.distances(with_base(arc.six, _joints(arc)[0]))
    row = int(np.argmin(distance))
    if distance[row] >= -TOUCHING:
        return None
    names = " and ".join(bodies.pairs[pair[row]])
    shapes = f" (shapes: {bodies.assumed})" if bodies.assumed else ""
    return Violation(PATH, f"links {names} overlap by {-distance[row]:.4g} m{shapes}")


# [S2]'s joint motions as functions of time: STEPs from the first instant on, without a ramp.


@checked
def paper_motion(
    robot: Robot,
    gait: Gait | None = None,
    *,
    stroke: float | None = None,
    amplitude: float | None = None,
    lift_angle: float = PAPER_LIFT,
    profile: StanceProfile = "velocity-step",
    ramp_share: float = RAMP_SHARE,
) -> JointMotion:
    """Return the motion of coxae and femora as [S2] prescribes it; the tibiae stand.

    [S2] shows the motion of joints by STEP functions of their velocity (figure 3): "velocity-step".
    Its break points cannot be read; ramps of a tenth of each move are *assumed*. The other two
    profiles are readings of the text alone.

    It is the steady part of `ArcWalk`, from t = 0 on: each leg begins in the phase that the gait
    gives it, so that coxae stand off their standing direction, and some move, at the start.

    Args:
        robot: with six legs that point sideways.
        gait: order, duty and cycle time of the steps; None: [S2]'s tetrapod in 2.4 s. Its stroke
            and lift are not used.
        stroke: travel of the body during a stance [m]: the amplitude is asin(stroke / 2 R), R the
            mean distance of the feet from their yaw axes.
        amplitude: of the coxae to either side [rad], in place of the stroke; with neither [S2]'s
            20 degrees, for which it prints a stroke of 0.14 m (kharagpur: 0.1388 m).
        lift_angle: of the femora in swing [rad]; default [S2]'s 6 degrees.
        profile: of coxae in stance and of all moves in swing: "velocity-step", rates that rise by a
            STEP and fall by a STEP; "step", angles by STEPs; or "constant", as of `ArcWalk`.
        ramp_share: of a "velocity-step", as of `ArcWalk` [-].

    Raises:
        ParameterError: stroke and amplitude both given, or a value out of range.
        GaitError: joint ranges, joint rates, or legs that touch forbid it.

    Example:
        >>> motion = paper_motion(robot, Gait.tetrapod(cycle_time=3.0), stroke=0.12)
    """
    gait = Gait.tetrapod() if gait is None else gait
    if stroke is not None:
        if amplitude is not None:
            raise ParameterError(
                "paper_motion.amplitude", amplitude, "left out: the stroke is given"
            )
        amplitude = _amplitude(robot, stroke)
    walk = ArcWalk(
        gait,
        amplitude=PAPER_AMPLITUDE if amplitude is None else amplitude,
        lift_angle=lift_angle,
        profile=profile,
        ramp_share=ramp_share,
    )
    path = walk.path(robot)
    gait = path.gait
    refuse_impossible_arc(robot, path)
    motion: dict[str, float | MotionFunction] = {}
    for leg, sense, phase in zip(path.six.legs, arc_senses(path.six)[1], gait.phases, strict=True):
        yaw, lift = _yaw(walk, sense[0], leg.posture[0]), _lift(walk, sense[1], leg.posture[1])
        for joint, function in zip(leg.joints[:2], (yaw, lift), strict=True):
            motion[joint] = Periodic(
                function=function, period=gait.cycle_time, start=phase * gait.cycle_time
            )
    period = gait.cycle_time
    return JointMotion(motion, cycle_time=period, steady_from=period, speed=path.speed)


def _amplitude(robot: Robot, stroke: float) -> float:
    """Return the amplitude of a stroke [m] on this robot [rad].

    Raises:
        ParameterError: no amplitude has that stroke.
    """
    longest = 2.0 * float(ArcWalk().path(robot).radius.mean())
    if not 0.0 < stroke < longest:
        raise ParameterError(
            "paper_motion.stroke", stroke, f"above 0 and below {longest:.4g} m, twice the reach"
        )
    return float(np.arcsin(stroke / longest))


def _yaw(walk: ArcWalk, sense: float, mean: float) -> MotionFunction:
    """Return the coxa's angle from a placement to the next [rad]; `mean` is where it stands."""
    period, a = walk.gait.cycle_time, sense * walk.amplitude
    lifted = walk.gait.duty * period
    if walk.profile != "constant":
        back = _move(walk, 0.0, lifted, mean + a, mean - a)
        return Sum(terms=(back, _move(walk, lifted, period, 0.0, 2.0 * a)))
    length, rate = period - lifted, -2.0 * a / lifted
    h, dh, _ = adams_step(np.array([BLEND_SHARE, 1.0 - BLEND_SHARE]))
    blended = mean - a + 2.0 * a * h
    swing_rate = 2.0 * a / length * dh
    return Hermite(
        time=(
            0.0, lifted, lifted + BLEND_SHARE * length, period - BLEND_SHARE * length, period
        ),
        value=(mean + a, mean - a, *blended.tolist(), mean + a),
        rate=(rate, rate, *swing_rate.tolist(), rate),
    )  # fmt: skip


def _lift(walk: ArcWalk, sense: float, mean: float) -> MotionFunction:
    """Return the femur's angle from a placement to the next [rad]; `mean` is where it stands."""
    period, up = walk.gait.cycle_time, sense * walk.lift_angle
    lifted = walk.gait.duty * period
    middle = 0.5 * (lifted + period)
    rise = _move(walk, lifted, middle, mean, mean + up)
    return Sum(terms=(rise, _move(walk, middle, period, 0.0, -up)))


def _move(
    walk: ArcWalk, start: float, end: float, initial: float, final: float
) -> Step | VelocityStep:
    """Return a move between two angles [rad] and times [s] as the walk's profile has it."""
    if walk.profile != "velocity-step":
        return Step(start=start, end=end, initial=initial, final=final)
    return VelocityStep(
        start=start, end=end, initial=initial, final=final, ramp_share=walk.ramp_share
    )
