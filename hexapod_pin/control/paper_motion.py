"""[S2]'s joint motions as functions of time: STEPs from the first instant on, without a ramp."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.control.arc_path import StanceProfile
from hexapod_pin.control.arc_profile import BLEND_SHARE, arc_senses
from hexapod_pin.control.arc_refusal import refuse_impossible_arc
from hexapod_pin.control.arc_walk import PAPER_AMPLITUDE, PAPER_LIFT, ArcWalk
from hexapod_pin.control.curves import Hermite
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_motion import JointMotion
from hexapod_pin.control.motion_function import MotionFunction
from hexapod_pin.control.step_functions import Step, adams_step
from hexapod_pin.control.time_function import Periodic, Sum
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


@checked
def paper_motion(
    robot: Robot,
    gait: Gait | None = None,
    *,
    stroke: float | None = None,
    amplitude: float | None = None,
    lift_angle: float = PAPER_LIFT,
    profile: StanceProfile = "step",
) -> JointMotion:
    """Return the motion of coxae and femora as [S2] prescribes it; the tibiae stand.

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
        profile: of the coxae in stance, one STEP or a "constant" rate, as of `ArcWalk`.

    Raises:
        ParameterError: stroke and amplitude both given, or a value out of range.
        GaitError: joint ranges, joint rates, or legs in each other's way forbid it.

    Example:
        >>> motion = paper_motion(robot, Gait.tetrapod(cycle_time=3.0), stroke=0.12)
    """
    gait = Gait.tetrapod() if gait is None else gait
    if stroke is not None:
        if amplitude is not None:
            raise ParameterError(
                "paper_motion amplitude", amplitude, "left out: the stroke is given"
            )
        amplitude = _amplitude(robot, stroke)
    walk = ArcWalk(
        gait,
        amplitude=PAPER_AMPLITUDE if amplitude is None else amplitude,
        lift_angle=lift_angle,
        profile=profile,
    )
    path = walk.path(robot)
    gait = path.gait
    refuse_impossible_arc(robot, gait, walk.amplitude, lift_angle, profile)
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
            "paper_motion stroke", stroke, f"above 0 and below {longest:.4g} m, twice the reach"
        )
    return float(np.arcsin(stroke / longest))


def _yaw(walk: ArcWalk, sense: float, mean: float) -> MotionFunction:
    """Return the coxa's angle from a placement to the next [rad]; `mean` is where it stands."""
    period, a = walk.gait.cycle_time, sense * walk.amplitude
    lifted = walk.gait.duty * period
    if walk.profile == "step":
        back = Step(begin=0.0, end=lifted, initial=mean + a, final=mean - a)
        return Sum(terms=(back, Step(begin=lifted, end=period, initial=0.0, final=2.0 * a)))
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
    rise = Step(begin=lifted, end=middle, initial=mean, final=mean + up)
    return Sum(terms=(rise, Step(begin=middle, end=period, initial=0.0, final=-up)))
