"""HC32 to HC35, HC38: what a whole robot's run must survive."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from hexapod_pin.control.gait import Gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.sampled_trajectory import HoldPosture, SampledTrajectory
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError, ReachError
from hexapod_pin.ground.contact import Contact, HuntCrossley, KelvinVoigt, NormalLaw, Restitution
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.case import simulate
from hexapod_pin.validation.case_result import ExpectedValue, relative
from hexapod_pin.validation.cases.bodies import NO_JOINT_STOPS, on_ground, particle, state
from hexapod_pin.validation.cases.bounce import SMOOTH_LAWS
from hexapod_pin.validation.cases.robots import G, answers, robot_file
from hexapod_pin.validation.cases.slope import FRICTION_LAWS
from hexapod_pin.validation.hard_case import HardCase, NotCovered, Trial
from hexapod_pin.validation.solver_setting import (
    IMPLICIT_1MS,
    REFERENCE,
    ROBUST_1MS,
    CaseRun,
    SolverSetting,
    rk4,
)

Values = Iterator[ExpectedValue]

# --- HC32 ---------------------------------------------------------------------------------------


def walking(setting: SolverSetting, duration: float) -> Values:
    """Seconds of walking; the hour is `python scripts/studies one_hour`."""
    robot = load_robot("kharagpur")
    control = KinematicControl(Gait.tetrapod(stroke=0.14, cycle_time=2.4))
    trace = simulate(Scene(robot), control, duration=duration, sample=0.1, **setting.arguments)
    name = f"{duration:g} s of walking"
    bad = float(np.sum(~np.isfinite(trace.q)))
    yield ExpectedValue(f"numbers not finite, {name}", bad, 0.0, "count")
    off = float(np.abs(np.linalg.norm(trace.q[:, 3:7], axis=1) - 1.0).max())
    yield ExpectedValue(f"quaternion norm, {name}", off, 1e-12)
    drift = float(np.abs(trace.time - 0.1 * np.arange(len(trace.time))).max())
    yield ExpectedValue(f"time stamps, {name}", drift, 1e-9, "s")


# --- HC33 ---------------------------------------------------------------------------------------

NORMAL_LAWS: dict[str, NormalLaw] = {
    "elastic": HuntCrossley(stiffness=1e6),
    "restitution": Restitution(stiffness=1e6, restitution=0.3),
    "s2": Contact.s2().normal,
    **SMOOTH_LAWS,
    "kelvin-voigt": KelvinVoigt(stiffness=1e5, damping=10.0),
}


def denormal(setting: SolverSetting, normal: str, friction: str) -> Values:
    """Depth and speed of 1e-310: forces vanish, nothing slows down."""
    robot = particle()
    scene = on_ground(
        robot, NORMAL_LAWS[normal], friction=FRICTION_LAWS[friction], gravity=(0.0, 0.0, 0.0)
    )
    tiny = state(robot, (0.0, 0.0, -1e-310), (1e-310, 1e-310, -1e-310))
    trace = CaseRun(scene, tiny, 0.1, 1e-3).by(setting)
    bad = not np.isfinite(trace.q).all()
    numbers = np.abs(np.concatenate([trace.v.ravel(), trace.foot_force.ravel()]))
    largest = math.inf if bad else float(np.where(np.isfinite(numbers), numbers, math.inf).max())
    yield ExpectedValue(f"largest force and speed, {normal}, {friction}", largest, 1e-300, "N, m/s")


# --- HC34 ---------------------------------------------------------------------------------------


def refused(_: None, bad: float) -> Values:
    """Set-points that are no numbers are refused; the message names joint and time."""
    robot = load_robot(robot_file("hexa_ref"))
    q = np.zeros((2, 18))
    q[1, 3] = bad
    message = "not refused"
    try:
        simulate(Scene(robot), SampledTrajectory([0.0, 0.1], q), duration=0.2)
    except ParameterError as error:
        message = str(error)
    missing = float(not ("0.1" in message and robot.joint_names[3] in message))
    what = f"set-point {bad} at 0.1 s: a typed error that tells joint and time"
    yield ExpectedValue(what, missing, 0.0, note=message[:120])


def saturated(setting: SolverSetting) -> Values:
    """Huge set-points saturate the servos."""
    robot = load_robot(robot_file("hexa_ref"))
    q = np.tile(np.tile([0.0, -0.3, 0.3], 6), (2, 1))
    q[1, 3] = 1e308
    scene = Scene(robot, servo=Servo(kp=20.0, kd=0.5, limited=True))
    held = SampledTrajectory([0.0, 0.1], q, limited=False)
    trace = simulate(scene, held, duration=0.12, sample=0.01, **setting.arguments)
    excess = np.abs(trace.torque) - robot.effort_limit
    wrong = float(max(excess.max(), 0.0 if np.isfinite(trace.q).all() else math.inf))
    yield ExpectedValue("torque beyond the effort at 1e308 rad", max(0.0, wrong), 1e-10, "N m")


# --- HC35 ---------------------------------------------------------------------------------------


def upside_down(setting: SolverSetting) -> Values:
    """The robot on its back: attitude at 180 degrees."""
    robot = load_robot(robot_file("hexa_ref"))
    q = np.zeros(25)
    q[2], q[3] = 0.05, 1.0
    servo = Servo(kp=200.0, kd=4.0, limited=False)
    scene = Scene(robot, servo=servo, stops=NO_JOINT_STOPS)
    start = robot.check_state(q, np.zeros(24))
    trace = CaseRun(scene, start, 0.08, 0.01, HoldPosture(np.zeros(18))).by(setting)
    off = np.abs(np.linalg.norm(trace.q[:, 3:7], axis=1) - 1.0)
    yield ExpectedValue("quaternion norm at 180 degrees", float(off.max()), 1e-12)
    if setting.adaptive:  # its feet point upwards: it falls freely
        lost = trace.com[:, 2] - trace.com[0, 2] + 0.5 * G * trace.time**2
        yield ExpectedValue("free fall on its back", float(np.abs(lost).max()), setting.value, "m")


# --- HC38 ---------------------------------------------------------------------------------------


def _reference_leg() -> LegKinematics:
    robot = load_robot(robot_file("hexa_ref"))
    return LegKinematics.of(robot, robot.legs[0].name)


def straight_knee(_: None, eps: str) -> Values:
    """The knee angle of a foot that is `eps` [m] short of straight."""
    error = relative(knee_angle(float(eps)), float(answers("HC38")[eps]["knee_angle"]))
    yield ExpectedValue(f"knee angle {eps} m short of straight", error, 1e-6)


def out_of_reach(_: None) -> Values:
    """A foot beyond reach is refused."""
    try:
        knee_angle(-1e-6)
        accepted = 1.0
    except ReachError:
        accepted = 0.0
    yield ExpectedValue("1 um beyond reach is refused", accepted, 0.0, "count")


def singular_leg(_: None) -> Values:
    """HC38b: the Jacobian of a straight leg is singular."""
    straight = _reference_leg().jacobian(np.array([0.0, -0.3, -0.5 * math.pi]))
    least = float(np.linalg.svd(straight, compute_uv=False)[-1])
    yield ExpectedValue("least singular value of a straight leg", least, 1e-15, "m")


def knee_angle(eps: float) -> float:
    """Return the bend of the knee for a foot `eps` [m] nearer than straight [rad]."""
    leg = _reference_leg()
    hip, knee, foot = leg.origins[1], leg.origins[2], leg.foot
    reach = float(np.linalg.norm(knee - hip) + np.linalg.norm(foot - knee))
    outward = (knee - hip) / np.linalg.norm(knee - hip)
    q = leg.inverse((hip + (reach - eps) * outward)[np.newaxis], limits=False)
    bend = math.remainder(float(np.ravel(q)[2]) - _straight(leg), 2.0 * math.pi)
    return abs(bend)


def _straight(leg: LegKinematics) -> float:
    """Return the knee angle at which hip, knee and foot are in line [rad]."""
    upper = leg.origins[2] - leg.origins[1]
    lower = leg.foot - leg.origins[2]
    axis = leg.axes[2]
    return math.atan2(float(np.cross(lower, upper) @ axis), float(lower @ upper))


_ALL_LAWS = tuple(product(NORMAL_LAWS, FRICTION_LAWS))
_SHORT_OF_STRAIGHT = tuple((eps,) for eps in answers("HC38") if float(eps) >= 1e-9)
"""Nearer, the target's own rounding moves the answer."""

CASES = (
    HardCase("HC32", "long walks: NaN, quaternion, clock", (
        Trial(walking, (IMPLICIT_1MS, ROBUST_1MS), variants=((9.6,),)),
        Trial(walking, (IMPLICIT_1MS, ROBUST_1MS), variants=((60.0,),), slow=True),
    )),
    HardCase("HC33", "denormal depth and speed", (
        Trial(denormal, REFERENCE, variants=_ALL_LAWS[::5][:3]),
        Trial(denormal, (IMPLICIT_1MS, rk4(1e-3)), variants=_ALL_LAWS, quick_settings=2),
    )),
    HardCase("HC34", "set-points nan, inf, 1e308", (
        Trial(refused, (None,), variants=((math.nan,), (math.inf,)), label="refused"),
        Trial(saturated, (IMPLICIT_1MS,)),
    )),
    HardCase("HC35", "on its back", (
        Trial(upside_down, (SolverSetting("extrapolated-euler", 1e-6), IMPLICIT_1MS, ROBUST_1MS),
              quick_settings=2),
        NotCovered("trunk in the ground",
                   "only feet touch; a trunk below the ground is not noticed, the run goes on"),
    )),
    HardCase("HC38", "straight knee: acos loses half the digits", (
        Trial(straight_knee, (None,), variants=_SHORT_OF_STRAIGHT),
        Trial(out_of_reach, (None,)),
    )),
    HardCase("HC38b", "Jacobian of a straight leg", (
        Trial(singular_leg, (None,), label="Jacobian"),
    )),
)  # fmt: skip
