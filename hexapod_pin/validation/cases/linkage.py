"""HC12, HC13, HC20, HC22: linkages on a fixed base.

The core knows floating bases only. The base is 1e12 kg on four undamped linear springs (see
`hard_bodies.anchored`): it moves by 1e-12 of what it would at 1 kg. HC22 has no gravity and needs
no springs. The heavy top hangs on three hinges whose first two bodies weigh 1e-12 kg.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.control.hold_posture import HoldPosture
from hexapod_pin.drive.servo import Servo
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.validation.cases.bodies import FREE, Link, anchored, anchored_scene, state
from hexapod_pin.validation.cases.case_result import HardCase, HardRow
from hexapod_pin.validation.cases.reference_data import G, answers
from hexapod_pin.validation.cases.solver_settings import (
    HIGH_ORDER,
    MILLISECOND,
    Run,
    Wanted,
    measured,
    ways,
)

TIBIA_MASS, TIBIA_COM, TIBIA_MOMENT = 0.11, 0.049395, 87.515e-6
"""Tibia of S2 Table 1: [kg], centre of mass from the knee [m], moment about it [kg m^2]."""


# --- HC12 ---------------------------------------------------------------------------------------


def hc12(quick: bool) -> Iterator[HardRow]:
    """Periods of pendulums released at 10 to 179.999 degrees."""
    # 1 kg at 0.05 m with 0.0025 kg m^2 about it swings as a point at 0.1 m
    point = Link(1.0, (0.0, 0.0, -0.05), (0.0025,) * 3)
    tibia = Link(TIBIA_MASS, (0.0, 0.0, -TIBIA_COM), (TIBIA_MOMENT,) * 3)
    for way in ways(quick):
        for name, link in (("point_mass_l0.1", point), ("tibia", tibia)):
            for degrees, period in answers("HC12")[name].items():
                what = f"period of {name.split('_')[0]} from {degrees} degrees"
                look = partial(_swing, link, float(degrees), float(period), what)
                yield from measured("HC12", what, way, look, required=HIGH_ORDER)


def _swing(link: Link, degrees: float, period: float, what: str, way: Setting) -> Iterator[Wanted]:
    scene, start = anchored_scene(anchored([link]), [math.radians(degrees)], [0.0])
    quarters = 5 if degrees < 179.95 else 1
    end = 0.25 * quarters * period
    trace = Run(scene, start, end, 0.25 * period).by(way)
    late = trace.q[-1, 7] / trace.v[-1, 6]  # it should hang straight down
    note = "" if quarters > 1 else "first quarter; later ones hang on the last bit of the energy"
    yield Wanted(what, abs(late) / end, 1e-8, note=note)


# --- HC13 ---------------------------------------------------------------------------------------

Numbers = tuple[float, float, float, float, float, float, float]
"""m1, c1, l1, J1, m2, c2, J2, SI."""


def hc13(quick: bool) -> Iterator[HardRow]:
    """A double pendulum from horizontal, 1 s; also with a tip of 1e4 and 1e-4 of the mass."""
    case = answers("HC13")["seed_leg_femur_tibia"]
    leg: Numbers = tuple(float(x) for x in case["params_m1,c1,l1,J1,m2,c2,J2"])  # type: ignore[assignment]
    known = np.array([float(x) for x in case["theta1,theta2,dtheta1,dtheta2 at 1s"]])
    for way in ways(quick):
        what = "femur and tibia: angles and rates at 1 s"
        look = partial(_double, leg, known, what)
        yield from measured("HC13", what, way, look, required=HIGH_ORDER)
        for ratio in (1e4, 1e-4):
            # both masses scaled, which changes nothing, so that 1e12 kg hold them
            size = min(1.0, 1.0 / ratio)
            scales = (size, 1.0, 1.0, size, ratio * size, 1.0, ratio * size)
            numbers: Numbers = tuple(x * s for x, s in zip(leg, scales, strict=True))  # type: ignore[assignment]
            what = f"tip of {ratio:g} times the mass: angles and rates at 1 s"
            look = partial(_double, numbers, double_pendulum(numbers), what)
            yield from measured("HC13", what, way, look, required=HIGH_ORDER)


def _double(numbers: Numbers, known: Array, what: str, way: Setting) -> Iterator[Wanted]:
    m1, c1, l1, j1, m2, c2, j2 = numbers
    links = [
        Link(m1, (0.0, 0.0, -c1), (j1,) * 3),
        Link(m2, (0.0, 0.0, -c2), (j2,) * 3, place=(0.0, 0.0, -l1)),
    ]
    robot = anchored(links)
    scene, start = anchored_scene(robot, [0.5 * math.pi, 0.0], [0.0, 0.0])
    trace = Run(scene, start, 1.0).by(way)
    angles, rates = np.cumsum(trace.q[-1, 7:]), np.cumsum(trace.v[-1, 6:])
    error = float(np.abs(np.concatenate([angles, rates]) - known).max())
    yield Wanted(what, error, 1e-8, "rad, rad/s")


def double_pendulum(numbers: Numbers) -> Array:
    """Return theta1, theta2 and rates at 1 s, written in absolute angles; DOP853 at 1e-13."""
    from scipy.integrate import solve_ivp

    m1, c1, l1, j1, m2, c2, j2 = numbers

    def rate(_: float, y: Array) -> Array:
        a, b, da, db = y
        couple = m2 * l1 * c2
        mass = np.array(
            [
                [j1 + m1 * c1**2 + m2 * l1**2, couple * math.cos(a - b)],
                [couple * math.cos(a - b), j2 + m2 * c2**2],
            ]
        )
        load = np.array(
            [
                -couple * math.sin(a - b) * db**2 - (m1 * c1 + m2 * l1) * G * math.sin(a),
                couple * math.sin(a - b) * da**2 - m2 * c2 * G * math.sin(b),
            ]
        )
        return np.concatenate([y[2:], np.linalg.solve(mass, load)])

    start = np.array([0.5 * math.pi, 0.5 * math.pi, 0.0, 0.0])
    found = solve_ivp(rate, (0.0, 1.0), start, method="DOP853", rtol=1e-13, atol=1e-14)
    end: Array = found.y[:, -1]
    return end


# --- HC20 ---------------------------------------------------------------------------------------


def hc20(quick: bool) -> Iterator[HardRow]:
    """The heavy top of Bruels and Cardona, 2 s at 150 rad/s."""
    for way in ways(quick):
        yield from measured("HC20", "centre of mass at 2 s", way, _top)


def _top(way: Setting) -> Iterator[Wanted]:
    import pinocchio as pin

    tiny = {"mass": 1e-12, "com": (0.0, 0.0, 0.0), "inertia": (1e-13,) * 3}
    spun = Link(15.0, (0.0, 1.0, 0.0), (0.234375, 0.46875, 0.234375), axis=(0.0, 1.0, 0.0))
    # this order of the hinges keeps 2 degrees from a singular attitude; z, x, y would reach it
    hinges = [Link(**tiny, axis=(1.0, 0.0, 0.0)), Link(**tiny, axis=(0.0, 0.0, 1.0))]  # type: ignore[arg-type]
    robot = anchored([*hinges, spun])
    scene, start = anchored_scene(robot, np.zeros(3), [0.0, -4.61538, 150.0])
    trace = Run(scene, start, 2.0).by(way)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, trace.q[-1])
    top = data.oMi[robot.model.njoints - 1]
    com = top.rotation @ np.array([0.0, 1.0, 0.0])
    wanted = np.array([float(x) for x in answers("HC20")["com_position(2s)"]])
    yield Wanted("centre of mass at 2 s", float(np.abs(com - wanted).max()), 1e-7, "m")


# --- HC22 ---------------------------------------------------------------------------------------


def hc22(quick: bool) -> Iterator[HardRow]:
    """A servo with rates from 41 to 2.8e5 1/s on a knee without gravity."""
    for way in (*ways(quick), *ways(quick, MILLISECOND)):
        for name in answers("HC22"):
            if name == "I":
                continue
            adaptive = way.adaptive
            look = partial(_stiff_servo if adaptive else _no_blow_up, name)
            yield from measured("HC22", name, way, look)


def _knee(name: str, duration: float, way: Setting) -> Trace:
    kp, kd = (float(part.split("=")[1]) for part in name.split(","))
    tibia = Link(TIBIA_MASS, (0.0, 0.0, -TIBIA_COM), (TIBIA_MOMENT,) * 3)
    robot = anchored([tibia])
    servo = Servo(kp=kp, kd=kd, limited=False)
    scene = Scene(robot, servo=servo, gravity=(0.0, 0.0, 0.0), stops=FREE)
    high = state(robot, (0.0, 0.0, 1e3), joints=[0.0])
    return Run(scene, high, duration, controller=HoldPosture([1.0])).by(way)


def _stiff_servo(name: str, way: Setting) -> Iterator[Wanted]:
    for duration, key in ((1e-3, "q(1ms)"), (1e-2, "q(10ms)")):
        angle = _knee(name, duration, way).q[-1, 7]
        error = abs(angle - float(answers("HC22")[name][key]))
        yield Wanted(f"{key}, {name}", error, 1e-7, "rad")


def _no_blow_up(name: str, way: Setting) -> Iterator[Wanted]:
    angle = _knee(name, 1.0, way).q[-1, 7]
    yield Wanted(f"|q(1 s) - 1|, {name}", abs(angle - 1.0), 1e-6, "rad")


CASES = (
    HardCase("HC12", "pendulums up to 179.999 degrees: no small angles, no damping", hc12),
    HardCase("HC13", "chaotic leg; mass ratios 1e4 and 1e-4", hc13),
    HardCase("HC20", "fast top: attitude error over 48 turns", hc20),
    HardCase("HC22", "servo rates far above 1/step", hc22),
)
