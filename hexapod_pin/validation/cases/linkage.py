"""HC12, HC13, HC20, HC22: linkages on a fixed base.

The core knows floating bases only. The base is 1e12 kg on four undamped linear springs (see
`bodies.anchored`): it moves by 1e-12 of what it would at 1 kg. HC22 has no gravity and needs
no springs. The heavy top hangs on three hinges whose first two bodies weigh 1e-12 kg.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.drive.servo import Servo
from hexapod_pin.results.trace import Trace
from hexapod_pin.scene.scene import Scene
from hexapod_pin.validation.case_result import ExpectedValue
from hexapod_pin.validation.cases.bodies import (
    NO_JOINT_STOPS,
    ChainLink,
    anchored,
    anchored_scene,
    state,
)
from hexapod_pin.validation.cases.robots import G, answers
from hexapod_pin.validation.hard_case import HardCase, Trial
from hexapod_pin.validation.solver_setting import (
    DOP853,
    EXTRAPOLATED_EULER,
    IMPLICIT_1MS,
    REFERENCE,
    TIGHT,
    CaseRun,
    SolverSetting,
)

Values = Iterator[ExpectedValue]

TIBIA_MASS, TIBIA_COM, TIBIA_MOMENT = 0.11, 0.049395, 87.515e-6
"""Tibia of S2 Table 1: [kg], centre of mass from the knee [m], moment about it [kg m^2]."""


# --- HC12 ---------------------------------------------------------------------------------------


# 1 kg at 0.05 m with 0.0025 kg m^2 about it swings as a point at 0.1 m
PENDULUMS = {
    "point_mass_l0.1": ChainLink(1.0, (0.0, 0.0, -0.05), (0.0025,) * 3),
    "tibia": ChainLink(TIBIA_MASS, (0.0, 0.0, -TIBIA_COM), (TIBIA_MOMENT,) * 3),
}


def swing(setting: SolverSetting, name: str, degrees: str) -> Values:
    """Period of a pendulum released at 10 to 179.999 degrees."""
    period, angle = float(answers("HC12")[name][degrees]), float(degrees)
    what = f"period of {name.partition('_')[0]} from {degrees} degrees"
    scene, start = anchored_scene(anchored([PENDULUMS[name]]), [math.radians(angle)], [0.0])
    quarters = 5 if angle < 179.95 else 1
    end = 0.25 * quarters * period
    trace = CaseRun(scene, start, end, 0.25 * period).by(setting)
    late = trace.q[-1, 7] / trace.v[-1, 6]  # it should hang straight down
    note = "" if quarters > 1 else "first quarter; later ones hang on the last bit of the energy"
    yield ExpectedValue(what, abs(late) / end, 1e-8, note=note)


# --- HC13 ---------------------------------------------------------------------------------------

Numbers = tuple[float, float, float, float, float, float, float]
"""m1, c1, l1, J1, m2, c2, J2, SI."""


def double(setting: SolverSetting, ratio: float) -> Values:
    """A double pendulum from horizontal, 1 s; its tip of a ratio of the mass."""
    case = answers("HC13")["seed_leg_femur_tibia"]
    leg: Numbers = tuple(float(x) for x in case["params_m1,c1,l1,J1,m2,c2,J2"])  # type: ignore[assignment]
    known, what = np.array([float(x) for x in case["theta1,theta2,dtheta1,dtheta2 at 1s"]]), ""
    if ratio != 1.0:
        # both masses scaled, which changes nothing, so that 1e12 kg hold them
        size = min(1.0, 1.0 / ratio)
        scales = (size, 1.0, 1.0, size, ratio * size, 1.0, ratio * size)
        leg = tuple(x * s for x, s in zip(leg, scales, strict=True))  # type: ignore[assignment]
        known, what = double_pendulum(leg), f"tip of {ratio:g} times the mass: "
    m1, c1, l1, j1, m2, c2, j2 = leg
    links = [
        ChainLink(m1, (0.0, 0.0, -c1), (j1,) * 3),
        ChainLink(m2, (0.0, 0.0, -c2), (j2,) * 3, place=(0.0, 0.0, -l1)),
    ]
    robot = anchored(links)
    scene, start = anchored_scene(robot, [0.5 * math.pi, 0.0], [0.0, 0.0])
    trace = CaseRun(scene, start, 1.0).by(setting)
    angles, rates = np.cumsum(trace.q[-1, 7:]), np.cumsum(trace.v[-1, 6:])
    error = float(np.abs(np.concatenate([angles, rates]) - known).max())
    yield ExpectedValue(f"{what}angles and rates at 1 s", error, 1e-8, "rad, rad/s")


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


def heavy_top(setting: SolverSetting) -> Values:
    """The heavy top of Bruels and Cardona, 2 s at 150 rad/s."""
    import pinocchio as pin

    tiny = {"mass": 1e-12, "com": (0.0, 0.0, 0.0), "inertia": (1e-13,) * 3}
    spun = ChainLink(15.0, (0.0, 1.0, 0.0), (0.234375, 0.46875, 0.234375), axis=(0.0, 1.0, 0.0))
    # this order of the hinges keeps 2 degrees from a singular attitude; z, x, y would reach it
    hinges = [ChainLink(**tiny, axis=(1.0, 0.0, 0.0)), ChainLink(**tiny, axis=(0.0, 0.0, 1.0))]  # type: ignore[arg-type]
    robot = anchored([*hinges, spun])
    scene, start = anchored_scene(robot, np.zeros(3), [0.0, -4.61538, 150.0])
    trace = CaseRun(scene, start, 2.0).by(setting)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, trace.q[-1])
    top = data.oMi[robot.model.njoints - 1]
    com = top.rotation @ np.array([0.0, 1.0, 0.0])
    expected = np.array([float(x) for x in answers("HC20")["com_position(2s)"]])
    yield ExpectedValue("centre of mass at 2 s", float(np.abs(com - expected).max()), 1e-7, "m")


# --- HC22 ---------------------------------------------------------------------------------------


def _knee(name: str, duration: float, setting: SolverSetting) -> Trace:
    kp, kd = (float(part.split("=")[1]) for part in name.split(","))
    tibia = ChainLink(TIBIA_MASS, (0.0, 0.0, -TIBIA_COM), (TIBIA_MOMENT,) * 3)
    robot = anchored([tibia])
    servo = Servo(kp=kp, kd=kd, limited=False)
    scene = Scene(robot, servo=servo, gravity=(0.0, 0.0, 0.0), stops=NO_JOINT_STOPS)
    high = state(robot, (0.0, 0.0, 1e3), joints=[0.0])
    return CaseRun(scene, high, duration, controller=HoldPosture([1.0])).by(setting)


def stiff_servo(setting: SolverSetting, name: str) -> Values:
    """A servo with rates from 41 to 2.8e5 1/s on a knee without gravity."""
    for duration, key in ((1e-3, "q(1ms)"), (1e-2, "q(10ms)")):
        angle = _knee(name, duration, setting).q[-1, 7]
        error = abs(angle - float(answers("HC22")[name][key]))
        yield ExpectedValue(f"{key}, {name}", error, 1e-7, "rad")


def large_steps(setting: SolverSetting, name: str) -> Values:
    """The same at rest after 1 s."""
    angle = _knee(name, 1.0, setting).q[-1, 7]
    yield ExpectedValue(f"|q(1 s) - 1|, {name}", abs(angle - 1.0), 1e-6, "rad")


_RELEASES = tuple((name, degrees) for name in PENDULUMS for degrees in answers("HC12")[name])
_NEAR_UPRIGHT = tuple(release for release in _RELEASES if float(release[1]) > 179.5)
_LARGE = tuple(release for release in _RELEASES if 90.0 < float(release[1]) < 179.5)
_MODERATE = tuple(release for release in _RELEASES if float(release[1]) <= 90.0)
_GAINS = tuple((name,) for name in answers("HC22") if name != "I")

CASES = (
    HardCase("HC12", "pendulums up to 179.999 degrees: no small angles, no damping", (
        Trial(swing, REFERENCE, variants=_MODERATE),
        Trial(swing, TIGHT, (EXTRAPOLATED_EULER,), _LARGE),
        Trial(swing, (DOP853,), REFERENCE[1:], _NEAR_UPRIGHT),
    )),
    HardCase("HC13", "chaotic leg; mass ratios 1e4 and 1e-4", (
        Trial(double, TIGHT, (EXTRAPOLATED_EULER,), ((1.0,), (1e4,))),
        Trial(double, (DOP853,), REFERENCE[1:], ((1e-4,),)),
    )),
    HardCase("HC20", "fast top: attitude error over 48 turns", (Trial(heavy_top, REFERENCE),)),
    HardCase("HC22", "servo rates far above 1/step", (
        Trial(stiff_servo, REFERENCE, variants=_GAINS),
        Trial(large_steps, (IMPLICIT_1MS,), variants=_GAINS),
    )),
)  # fmt: skip
