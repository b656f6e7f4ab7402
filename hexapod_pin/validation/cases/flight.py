"""HC11, HC14b, HC19: bodies in free flight."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.validation.case_result import ExpectedValue, relative
from hexapod_pin.validation.cases.bodies import NO_JOINT_STOPS, ZERO_GAIN_SERVO, body, state
from hexapod_pin.validation.cases.robots import answers, robot_file
from hexapod_pin.validation.hard_case import HardCase, Trial
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import (
    DOP853,
    EXTRAPOLATED_EULER,
    IMPLICIT_1MS,
    NDF,
    TIGHT,
    CaseRun,
    SolverSetting,
    rk4,
)

Values = Iterator[ExpectedValue]


def _spinning(inertia: tuple[float, float, float], spin: Array, duration: float) -> CaseRun:
    """Return a body in empty space, its base at its centre of mass."""
    robot = body({"foot": (0.0, 0.0, 0.0)}, inertia=inertia)
    scene = Scene(robot, servo=ZERO_GAIN_SERVO, gravity=(0.0, 0.0, 0.0), stops=NO_JOINT_STOPS)
    return CaseRun(scene, state(robot, (0.0, 0.0, 1.0), spin=spin), duration)


# --- HC11 ---------------------------------------------------------------------------------------

TRUNK = (0.0025185, 0.0166529, 0.0168972)
"""Principal moments of S2's trunk, sorted [kg m^2]."""


def flip(setting: SolverSetting, name: str) -> Values:
    """A free body flips about its middle axis."""
    import pinocchio as pin

    case = answers("HC11")[name]
    inertia = (1.0, 2.0, 3.0) if name.startswith("I=") else TRUNK
    spin = np.array([float(x) for x in case["omega0"]])
    moment = np.array(inertia)
    time = first_flip(moment, spin)
    run = _spinning(inertia, spin, time)
    trace = run.by(_dividing(setting, time))
    change = np.cross(moment * trace.v[-1, 3:6], trace.v[-1, 3:6]) / moment
    late = trace.v[-1, 4] / change[1]  # its middle rate should be zero
    tolerance = 1e-6 if "1e-6" in name else 1e-8
    yield ExpectedValue(f"time of the first flip, {name}", abs(float(late)) / time, tolerance)
    momentum = [
        pin.Quaternion(q[3:7]).matrix() @ (moment * v[3:6])
        for q, v in zip(trace.q, trace.v, strict=True)
    ]
    drift = np.linalg.norm(momentum[-1] - momentum[0]) / np.linalg.norm(momentum[0])
    yield ExpectedValue(f"angular momentum, {name}", float(drift), 1e-10)
    if "omega_body(10s)" in case:
        after = run.lasting(10.0).by(setting)
        known = np.array([float(x) for x in case["omega_body(10s)"]])
        error = float(np.abs(after.v[-1, 3:6] - known).max() / np.abs(spin).max())
        yield ExpectedValue(f"body rates after 10 s, {name}", error, tolerance)


def first_flip(moments: Array, spin: Array) -> float:
    """Return when the middle rate of a free body is first zero [s].

    From Euler's equations with their two integrals (Landau and Lifshitz, Mechanics, section 37):
    the middle rate w2 grows to M, where the first of the outer rates vanishes, then falls; with
    w2^2 = M^2 (1 - sin^2 phi) the time is an elliptic integral of the first kind in phi.

    Args:
        moments: principal moments in rising order [kg m^2]. Shape (3,).
        spin: body rates [rad/s]; no outer rate negative. Shape (3,).
    """
    from scipy.special import ellipk, ellipkinc

    low, middle, high = moments
    factor = np.array([(high - middle) / low, (high - low) / middle, (middle - low) / high])
    shares = spin**2 / factor
    first, other = (0, 2) if shares[0] <= shares[2] else (2, 0)
    beyond = factor[1] * shares[first]  # M^2 - w2^2 at first
    most = spin[1] ** 2 + beyond
    left = factor[other] * (shares[other] - shares[first])  # square of the other rate at M
    scale = factor[1] * math.sqrt(factor[first] / factor[1] * left)
    modulus = -factor[other] / factor[1] * most / left
    up = ellipkinc(math.asin(math.sqrt(beyond / most)), modulus)
    return float((ellipk(modulus) + up) / scale)


def _dividing(setting: SolverSetting, duration: float) -> SolverSetting:
    """Return the setting with its step, if it has one, moved so that it divides a duration."""
    if setting.adaptive:
        return setting
    return SolverSetting(setting.method, duration / math.ceil(duration / setting.value))


# --- HC14b --------------------------------------------------------------------------------------


def flying() -> tuple[Robot, CaseRun]:
    """Return the reference hexapod thrown up with all its joints moving, and its limp flight."""
    import pinocchio as pin

    robot, known = load_robot(robot_file("hexa_ref")), answers("HC14b")
    rates = dict(zip(known["joint_order"], known["v0_joints"], strict=True))
    q = pin.neutral(robot.model)
    q[2] = 1.0
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(*np.radians([4.0, -3.0, 0.0]))).coeffs()
    q[7:] = np.tile([0.0, -0.3, 0.3], 6)
    v = np.r_[0.3, -0.2, 1.0, 2.0, -1.0, 3.0, [rates[name] for name in robot.joint_names]]
    scene = Scene(robot, servo=ZERO_GAIN_SERVO, stops=NO_JOINT_STOPS)
    return robot, CaseRun(scene, robot.check_state(q, v), 0.5)


def flight(setting: SolverSetting) -> Values:
    """A limp hexapod in flight, 0.5 s."""
    import pinocchio as pin

    robot, run = flying()
    expected = answers("HC14b")
    trace = run.by(setting)
    energy = trace.energy["kinetic"] + trace.energy["potential"]
    error = max(relative(float(e), expected["energy"]) for e in energy)
    yield ExpectedValue("energy", error, 1e-10)
    data = robot.model.createData()
    pin.computeCentroidalMomentum(robot.model, data, trace.q[-1], trace.v[-1])
    known = np.array(expected["angular_momentum_about_com"])
    off = float((np.abs(data.hg.angular - known) / np.abs(known)).max())
    yield ExpectedValue("angular momentum", off, 1e-10)
    fallen = np.abs(trace.com[-1] - expected["com_0.5s"]).max()
    yield ExpectedValue("centre of mass", float(fallen), 1e-10, "m")
    angles = dict(zip(expected["joint_order"], expected["q_joints_0.5s"], strict=True))
    joints = [angles[name] for name in robot.joint_names]
    final = np.r_[expected["base_xyz_0.5s"], expected["quat_xyzw_0.5s"], joints]
    apart = PositionError.between(trace.q[-1:], final[np.newaxis]).q
    yield ExpectedValue("all positions", apart, 1e-7, "m, rad")


# --- HC19 ---------------------------------------------------------------------------------------


def turning(setting: SolverSetting, duration: float) -> Values:
    """10 rad/s for a long time."""
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    trace = _spinning((0.01,) * 3, 10.0 * axis, duration).by(setting)
    x = trace.q[-1, 3:7]
    half = 0.5 * 10.0 * duration
    expected = np.r_[math.sin(half) * axis, math.cos(half)]
    if duration == 3600.0:
        known = np.array([float(v) for v in answers("HC19")["q"]])
        expected = np.r_[known[1:], known[0]]
    error = 2.0 * min(float(np.linalg.norm(x - s * expected)) for s in (1.0, -1.0))
    yield ExpectedValue(f"attitude after {duration:g} s", error, 1e-9, "rad")
    off = float(np.abs(np.linalg.norm(trace.q[:, 3:7], axis=1) - 1.0).max())
    yield ExpectedValue(f"quaternion norm after {duration:g} s", off, 1e-12)


_SPINS = tuple((name,) for name in answers("HC11"))

CASES = (
    HardCase("HC11", "flips about the middle axis: momentum drift of quaternion steps", (
        Trial(flip, (*TIGHT, rk4(1e-4)), (EXTRAPOLATED_EULER,), _SPINS),
    )),
    HardCase("HC14b", "24 degrees of freedom in flight: silent damping, drift", (
        Trial(flight, (DOP853, rk4(2e-4), NDF), (EXTRAPOLATED_EULER,), quick_settings=2),
    )),
    HardCase("HC19", "5730 turns: attitude integrated as q + h q'", (
        Trial(turning, (IMPLICIT_1MS, DOP853, EXTRAPOLATED_EULER), variants=((360.0,),)),
        Trial(turning, (IMPLICIT_1MS, EXTRAPOLATED_EULER), TIGHT,
              ((3600.0,),), slow=True),
    )),
)  # fmt: skip
