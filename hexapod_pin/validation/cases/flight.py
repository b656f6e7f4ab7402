"""HC11, HC14b, HC19: bodies in free flight."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.error import Distance
from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.validation.cases.bodies import FREE, LIMP, body, state
from hexapod_pin.validation.cases.case_result import HardCase, HardRow, relative
from hexapod_pin.validation.cases.reference_data import answers
from hexapod_pin.validation.cases.robots import robot_file
from hexapod_pin.validation.cases.solver_settings import TIGHT, TRUTH, Run, Wanted, measured, ways


def _spinning(inertia: tuple[float, float, float], spin: Array, duration: float) -> Run:
    """Return a body in empty space, its base at its centre of mass."""
    robot = body({"foot": (0.0, 0.0, 0.0)}, inertia=inertia)
    scene = Scene(robot, servo=LIMP, gravity=(0.0, 0.0, 0.0), stops=FREE)
    return Run(scene, state(robot, (0.0, 0.0, 1.0), spin=spin), duration)


# --- HC11 ---------------------------------------------------------------------------------------

TRUNK = (0.0025185, 0.0166529, 0.0168972)
"""Principal moments of S2's trunk, sorted [kg m^2]."""


def hc11(quick: bool) -> Iterator[HardRow]:
    """A free body flips about its middle axis."""
    cases = answers("HC11")
    exact = Setting("rk4", 1e-4)
    for way in (TRUTH[0],) if quick else (exact, *TRUTH):
        for name in cases:
            look = partial(_flip, name, cases[name])
            yield from measured("HC11", name, way, look, required=TIGHT)


def _flip(name: str, case: dict[str, Any], way: Setting) -> Iterator[Wanted]:
    import pinocchio as pin

    inertia = (1.0, 2.0, 3.0) if name.startswith("I=") else TRUNK
    spin = np.array([float(x) for x in case["omega0"]])
    moment = np.array(inertia)
    time = first_flip(moment, spin)
    run = _spinning(inertia, spin, time)
    trace = run.by(_dividing(way, time))
    change = np.cross(moment * trace.v[-1, 3:6], trace.v[-1, 3:6]) / moment
    late = trace.v[-1, 4] / change[1]  # its middle rate should be zero
    tolerance = 1e-6 if "1e-6" in name else 1e-8
    yield Wanted(f"time of the first flip, {name}", abs(float(late)) / time, tolerance)
    momentum = [
        pin.Quaternion(q[3:7]).matrix() @ (moment * v[3:6])
        for q, v in zip(trace.q, trace.v, strict=True)
    ]
    drift = np.linalg.norm(momentum[-1] - momentum[0]) / np.linalg.norm(momentum[0])
    yield Wanted(f"angular momentum, {name}", float(drift), 1e-10)
    if "omega_body(10s)" in case:
        after = Run(run.scene, run.start, 10.0).by(way)
        known = np.array([float(x) for x in case["omega_body(10s)"]])
        error = float(np.abs(after.v[-1, 3:6] - known).max() / np.abs(spin).max())
        yield Wanted(
            f"body rates after 10 s, {name}", error, tolerance, required=False,
            note="round-off in the energy, 1e-15 over eps^2, moves the second flip by 1e-7",
        )  # fmt: skip


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


def _dividing(way: Setting, duration: float) -> Setting:
    """Return the way with its step, if it has one, moved so that it divides a duration."""
    if way.adaptive:
        return way
    return Setting(way.method, duration / math.ceil(duration / way.value))


# --- HC14b --------------------------------------------------------------------------------------


def hc14b(quick: bool) -> Iterator[HardRow]:
    """A limp hexapod in flight, 0.5 s."""
    for way in ways(quick):
        yield from measured("HC14b", "flight", way, _flight, required=TIGHT)


def flying() -> tuple[Robot, Run]:
    """Return the reference hexapod thrown up with all its joints moving."""
    import pinocchio as pin

    robot = load_robot(robot_file("hexa_ref"))
    wanted = answers("HC14b")
    rates = dict(zip(wanted["joint_order"], _case_rates(), strict=True))
    q = pin.neutral(robot.model)
    q[2] = 1.0
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(*np.radians([4.0, -3.0, 0.0]))).coeffs()
    q[7:] = np.tile([0.0, -0.3, 0.3], 6)
    v = np.r_[0.3, -0.2, 1.0, 2.0, -1.0, 3.0, [rates[name] for name in robot.joint_names]]
    return robot, Run(Scene(robot, servo=LIMP, stops=FREE), robot.check_state(q, v), 0.5)


def _case_rates() -> list[float]:
    rates: list[float] = answers("HC14b")["v0_joints"]
    return rates


def _flight(way: Setting) -> Iterator[Wanted]:
    import pinocchio as pin

    robot, run = flying()
    wanted = answers("HC14b")
    trace = run.by(way)
    energy = trace.energy["kinetic"] + trace.energy["potential"]
    error = max(relative(float(e), wanted["energy"]) for e in energy)
    yield Wanted("energy", error, 1e-10)
    data = robot.model.createData()
    pin.computeCentroidalMomentum(robot.model, data, trace.q[-1], trace.v[-1])
    known = np.array(wanted["angular_momentum_about_com"])
    off = float(np.linalg.norm(data.hg.angular - known) / np.linalg.norm(known))
    yield Wanted("angular momentum", off, 1e-10)
    fallen = np.abs(trace.com[-1] - wanted["com_0.5s"]).max()
    yield Wanted("centre of mass", float(fallen), 1e-10, "m")
    angles = dict(zip(wanted["joint_order"], wanted["q_joints_0.5s"], strict=True))
    joints = [angles[name] for name in robot.joint_names]
    final = np.r_[wanted["base_xyz_0.5s"], wanted["quat_xyzw_0.5s"], joints]
    apart = Distance.between(trace.q[-1:], final[np.newaxis]).q
    yield Wanted("all positions", apart, 1e-7, "m, rad")


# --- HC19 ---------------------------------------------------------------------------------------


def hc19(quick: bool) -> Iterator[HardRow]:
    """10 rad/s for an hour (quick: six minutes) in steps of 1 ms."""
    way = Setting("implicit-euler", 1e-3)
    duration = 360.0 if quick else 3600.0
    yield from measured("HC19", "an hour of turning", way, partial(_turning, duration))
    for other in () if quick else TRUTH:
        look = partial(_turning, duration)
        yield from measured("HC19", "an hour of turning", other, look, required=())


def _turning(duration: float, way: Setting) -> Iterator[Wanted]:
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    trace = _spinning((0.01,) * 3, 10.0 * axis, duration).by(way)
    x = trace.q[-1, 3:7]
    half = 0.5 * 10.0 * duration
    wanted = np.r_[math.sin(half) * axis, math.cos(half)]
    if duration == 3600.0:
        known = np.array([float(v) for v in answers("HC19")["q"]])
        wanted = np.r_[known[1:], known[0]]
    error = 2.0 * min(float(np.linalg.norm(x - s * wanted)) for s in (1.0, -1.0))
    yield Wanted(f"attitude after {duration:g} s", error, 1e-9, "rad")
    off = float(np.abs(np.linalg.norm(trace.q[:, 3:7], axis=1) - 1.0).max())
    yield Wanted(f"quaternion norm after {duration:g} s", off, 1e-12)


CASES = (
    HardCase("HC11", "flips about the middle axis: momentum drift of quaternion steps", hc11),
    HardCase("HC14b", "24 degrees of freedom in flight: silent damping, drift", hc14b),
    HardCase("HC19", "5730 turns: attitude integrated as q + h q'", hc19),
)
