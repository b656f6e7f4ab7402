"""HC32 to HC36, HC38: what a whole robot's run must survive."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.hold_posture import HoldPosture
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.sampled_trajectory import SampledTrajectory
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError, ReachError
from hexapod_pin.ground.contact import Contact, HuntCrossley, Restitution, TanhCoulomb
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.simulation.run import simulate
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.validation.cases.bodies import FREE, on_ground, particle, state
from hexapod_pin.validation.cases.case_result import HardCase, HardRow, relative
from hexapod_pin.validation.cases.reference_data import G, answers
from hexapod_pin.validation.cases.robots import robot_file
from hexapod_pin.validation.cases.solver_settings import (
    LEGGED,
    MILLISECOND,
    Run,
    Wanted,
    measured,
    ways,
)

# --- HC32 ---------------------------------------------------------------------------------------


def hc32(quick: bool) -> Iterator[HardRow]:
    """A minute (quick: ten seconds) of walking; the hour is `benchmarks/one_hour.py`."""
    for way in ways(quick, LEGGED):
        look = partial(_walk, 9.6 if quick else 60.0)
        yield from measured("HC32", "walking", way, look)


def _walk(duration: float, way: Setting) -> Iterator[Wanted]:
    robot = load_robot("kharagpur")
    control = KinematicControl(Gait.tetrapod(stroke=0.14, cycle_time=2.4))
    trace = simulate(Scene(robot), control, duration=duration, sample=0.1, **way.arguments)
    off = float(np.abs(np.linalg.norm(trace.q[:, 3:7], axis=1) - 1.0).max())
    name = f"{duration:g} s of walking"
    yield Wanted(f"numbers not finite, {name}", float(np.sum(~np.isfinite(trace.q))), 0.0, "count")
    yield Wanted(f"quaternion norm, {name}", off, 1e-12)
    drift = float(np.abs(trace.time - 0.1 * np.arange(len(trace.time))).max())
    yield Wanted(f"time stamps, {name}", drift, 1e-9, "s")


# --- HC33 ---------------------------------------------------------------------------------------


def hc33(quick: bool) -> Iterator[HardRow]:
    """Depth and speed of 1e-310: forces vanish, nothing slows down."""
    for way in (*ways(quick), *ways(quick, MILLISECOND)):
        yield from measured("HC33", "denormals", way, _denormal)


def _denormal(way: Setting) -> Iterator[Wanted]:
    robot = particle()
    largest = 0.0
    for normal in (
        HuntCrossley(stiffness=1e6), Restitution(stiffness=1e6, restitution=0.3),
        Contact.s2().normal,
    ):  # fmt: skip
        friction = TanhCoulomb(mu=0.5, slope=1e3)
        scene = on_ground(robot, normal, friction=friction, gravity=(0.0, 0.0, 0.0))
        tiny = state(robot, (0.0, 0.0, -1e-310), (1e-310, 1e-310, -1e-310))
        trace = Run(scene, tiny, 0.1, 1e-3).by(way)
        numbers = np.abs(np.concatenate([trace.v.ravel(), trace.foot_force.ravel()]))
        largest = max(largest, float(np.where(np.isfinite(numbers), numbers, math.inf).max()))
    yield Wanted("largest force and speed", largest, 1e-300, "N, m/s")


# --- HC34 ---------------------------------------------------------------------------------------


def hc34(quick: bool) -> Iterator[HardRow]:
    """Set-points that are no numbers are refused by name; huge ones saturate."""
    robot = load_robot(robot_file("hexa_ref"))
    for bad in (math.nan, math.inf):
        q = np.zeros((2, 18))
        q[1, 3] = bad
        what = f"set-point {bad} at 0.1 s: a typed error that tells joint and time"
        told = _refusal(lambda q=q: simulate(  # type: ignore[misc]
            Scene(robot), SampledTrajectory([0.0, 0.1], q), duration=0.2
        ))  # fmt: skip
        missing = float(not ("0.1" in told and robot.joint_names[3] in told))
        yield HardRow("HC34", what, "refused", missing, 0.0, note=told[:120])
    yield from measured("HC34", "set-point 1e308", Setting("implicit-euler", 1e-3), _saturated)


def _refusal(run: Callable[[], object]) -> str:
    try:
        run()
    except ParameterError as error:
        return str(error)
    return "not refused"


def _saturated(way: Setting) -> Iterator[Wanted]:
    robot = load_robot(robot_file("hexa_ref"))
    q = np.tile(np.tile([0.0, -0.3, 0.3], 6), (2, 1))
    q[1, 3] = 1e308
    scene = Scene(robot, servo=Servo(kp=20.0, kd=0.5, limited=True))
    trace = simulate(
        scene, SampledTrajectory([0.0, 0.1], q), duration=0.12, sample=0.01, **way.arguments
    )
    excess = np.abs(trace.torque) - robot.effort
    wrong = float(max(excess.max(), 0.0 if np.isfinite(trace.q).all() else math.inf))
    yield Wanted("torque beyond the effort at 1e308 rad", max(0.0, wrong), 1e-10, "N m")


# --- HC35 ---------------------------------------------------------------------------------------


def hc35(quick: bool) -> Iterator[HardRow]:
    """The robot on its back: attitude at 180 degrees."""
    for way in (Setting("extrapolated-euler", 1e-6), *ways(quick, LEGGED)):
        yield from measured("HC35", "upside down", way, _upside_down)
    yield HardRow(
        "HC35", "trunk in the ground", "-", math.nan, math.nan,
        note="only feet touch; a trunk below the ground is not noticed, the run goes on",
    )  # fmt: skip


def _upside_down(way: Setting) -> Iterator[Wanted]:
    robot = load_robot(robot_file("hexa_ref"))
    q = np.zeros(25)
    q[2], q[3] = 0.05, 1.0
    scene = Scene(robot, servo=Servo(kp=200.0, kd=4.0, limited=False), stops=FREE)
    start = robot.check_state(q, np.zeros(24))
    trace = Run(scene, start, 0.08, 0.01, HoldPosture(np.zeros(18))).by(way)
    off = np.abs(np.linalg.norm(trace.q[:, 3:7], axis=1) - 1.0)
    yield Wanted("quaternion norm at 180 degrees", float(off.max()), 1e-12)
    if way.adaptive:  # its feet point upwards: it falls freely
        lost = trace.com[:, 2] - trace.com[0, 2] + 0.5 * G * trace.time**2
        yield Wanted("free fall on its back", float(np.abs(lost).max()), way.value, "m")


# --- HC38 ---------------------------------------------------------------------------------------


def hc38(quick: bool) -> Iterator[HardRow]:
    """A nearly straight knee, and a leg that cannot reach."""
    robot = load_robot(robot_file("hexa_ref"))
    leg = LegKinematics.of(robot, robot.legs[0].name)
    for eps, case in answers("HC38").items():
        if float(eps) < 1e-9:
            continue  # the target's own rounding moves the answer
        error = relative(_knee_angle(leg, float(eps)), float(case["knee_angle"]))
        yield HardRow("HC38", f"knee angle {eps} m short of straight", "closed form", error, 1e-6)
    try:
        _knee_angle(leg, -1e-6)
        refused = 1.0
    except ReachError:
        refused = 0.0
    yield HardRow("HC38", "1 um beyond reach is refused", "closed form", refused, 0.0, "count")
    straight = leg.jacobian(np.array([0.0, -0.3, -0.5 * math.pi]))
    least = float(np.linalg.svd(straight, compute_uv=False)[-1])
    yield HardRow("HC38b", "least singular value of a straight leg", "Jacobian", least, 1e-15, "m")


def _knee_angle(leg: LegKinematics, eps: float) -> float:
    """Return the bend of the knee for a foot `eps` [m] nearer than straight."""
    hip, knee, foot = leg.origins[1], leg.origins[2], leg.foot
    reach = float(np.linalg.norm(knee - hip) + np.linalg.norm(foot - knee))
    outward = (knee - hip) / np.linalg.norm(knee - hip)
    target = hip + (reach - eps) * outward
    q = leg.inverse(target[np.newaxis], limits=False)
    zero = _straight(leg)
    bend = math.remainder(float(np.ravel(q)[2]) - zero, 2.0 * math.pi)
    return abs(bend)


def _straight(leg: LegKinematics) -> float:
    """Return the knee angle at which hip, knee and foot are in line [rad]."""
    upper = leg.origins[2] - leg.origins[1]
    lower = leg.foot - leg.origins[2]
    axis = leg.axes[2]
    return math.atan2(float(np.cross(lower, upper) @ axis), float(lower @ upper))


CASES = (
    HardCase("HC32", "long walks: NaN, quaternion, clock", hc32),
    HardCase("HC33", "denormal depth and speed", hc33),
    HardCase("HC34", "set-points nan, inf, 1e308", hc34),
    HardCase("HC35", "on its back", hc35),
    HardCase("HC38", "straight knee: acos loses half the digits", hc38),
)
