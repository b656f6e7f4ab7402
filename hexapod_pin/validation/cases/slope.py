"""HC06, HC07, HC10, HC30: friction on planes, level and inclined."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.ground.contact import (
    BrownMcPhee,
    Contact,
    FrictionLaw,
    HuntCrossley,
    SmoothStep,
    StickSlip,
    TanhCoulomb,
)
from hexapod_pin.ground.terrain import Slope
from hexapod_pin.validation.case_result import ExpectedValue, relative
from hexapod_pin.validation.cases.bodies import ball, on_ground, particle, state
from hexapod_pin.validation.cases.robots import G, answers
from hexapod_pin.validation.hard_case import HardCase, Trial
from hexapod_pin.validation.solver_setting import (
    DOP853,
    EXTRAPOLATED_EULER,
    IMPLICIT_1MS,
    NDF,
    REFERENCE,
    TIGHT,
    CaseRun,
    SolverSetting,
    rk4,
)

Values = Iterator[ExpectedValue]
ELASTIC = HuntCrossley(stiffness=1e6)
TANH = TanhCoulomb(mu=0.5, slope=1000.0)
FRICTION_LAWS: dict[str, FrictionLaw] = {
    "tanh": TANH,
    "adams": Contact.s2().friction,
    "smooth-step": SmoothStep(mu_static=0.5, mu_dynamic=0.4, speed=5e-3),
    "brown-mcphee": BrownMcPhee(mu_static=0.5, mu_dynamic=0.4, speed=5e-3),
    "stick-slip": StickSlip(mu=0.5, mu_dynamic=0.4, stiffness=2e4, damping=2e3),
}


def downhill(heading: float, angle: float) -> tuple[Array, Array, Array]:
    """Return unit vectors down a slope that falls along `heading`, across it (left), and out."""
    import pinocchio as pin

    turn = pin.rpy.rpyToMatrix(0.0, angle, heading)
    return turn[:, 0], turn[:, 1], turn[:, 2]


def static_depth(angle: float) -> float:
    """Return the depth at which 1 kg rests on a slope [m]."""
    return float((G * math.cos(angle) / ELASTIC.stiffness) ** (2.0 / 3.0))


def slider(
    tangent: float, heading: float = 0.0, velocity: tuple[float, float] = (0.0, 0.0),
    *, friction: FrictionLaw = TANH,
) -> CaseRun:  # fmt: skip
    """Return a particle on a slope falling along `heading`; `velocity` down, across [m/s]."""
    angle = math.atan(tangent)
    down, across, out = downhill(heading, angle)
    robot = particle()
    start = state(robot, -static_depth(angle) * out, velocity[0] * down + velocity[1] * across)
    terrain = Slope(angle=-angle, heading=heading)
    return CaseRun(on_ground(robot, ELASTIC, friction=friction, terrain=terrain), start, 1.0)


def in_tilted_gravity(
    tangent: float, velocity: tuple[float, float] = (0.0, 0.0), *, friction: FrictionLaw = TANH
) -> CaseRun:
    """Return the same on level ground under gravity tilted towards +x."""
    robot, cosine = particle(), 1.0 / math.hypot(1.0, tangent)
    gravity = (G * tangent * cosine, 0.0, -G * cosine)
    start = state(robot, (0.0, 0.0, -static_depth(math.atan(tangent))), (*velocity, 0.0))
    return CaseRun(on_ground(robot, ELASTIC, friction=friction, gravity=gravity), start, 1.0)


# --- HC06 ---------------------------------------------------------------------------------------


def creep(setting: SolverSetting, tangent: str, tilted: bool) -> Values:
    """Creep below the friction angle; near it the speed settles slowly, 0.5 s at tan 0.4999."""
    run = in_tilted_gravity(float(tangent)) if tilted else slider(float(tangent))
    speed = run.lasting(15.0, 1.0).by(setting).v[-1, :3]
    expected = float(answers("HC06")["below_mu"][tangent]["creep_speed"])
    what = f"tan {tangent}{', gravity tilted' * tilted}"
    error = relative(float(np.linalg.norm(speed)), expected)
    yield ExpectedValue(f"creep speed after 15 s, {what}", error, 1e-6)
    yield ExpectedValue(f"sideways creep, {what}", abs(float(speed[1])), 1e-15, "m/s")


def sliding(setting: SolverSetting, tangent: float, key: str, tilted: bool) -> Values:
    """Speed after 1 s at and above the friction angle."""
    run = in_tilted_gravity(tangent) if tilted else slider(tangent)
    speed = float(np.linalg.norm(run.by(setting).v[-1, :3]))
    what = f"speed after 1 s, tan {tangent:g}{', gravity tilted' * tilted}"
    yield ExpectedValue(what, relative(speed, float(answers("HC06")[key])), 1e-6)


def creep_of_law(setting: SolverSetting, name: str, share: float) -> Values:
    """Each law creeps at the speed it documents; stick-slip stretches by its load and stays.

    The slope comes at once: a bristle damped less would overshoot its load, reach the cone at a
    share of 0.95, and slide on at its dynamic coefficient.
    """
    law = FRICTION_LAWS[name]
    tangent = share * law.limit
    trace = in_tilted_gravity(tangent, friction=law).lasting(10.0, 1.0).by(setting)
    what = f"{name} at {share:g} of its limit"
    if isinstance(law, StickSlip):
        speed = float(np.abs(trace.v[-1, :2]).max())
        yield ExpectedValue(f"speed, {what}", speed, 1e-12, "m/s")
        stretch = tangent * G / math.hypot(1.0, tangent) / law.stiffness
        yield ExpectedValue(f"stretch, {what}", relative(trace.q[-1, 0], stretch), 1e-6)
    else:
        error = relative(trace.v[-1, 0], law.creep_speed(tangent))
        yield ExpectedValue(f"creep speed, {what}", error, 1e-6)
    yield ExpectedValue(f"sideways creep, {what}", abs(float(trace.v[-1, 1])), 1e-15, "m/s")


def sliding_of_law(setting: SolverSetting, name: str) -> Values:
    """Above its limit a law accelerates by g cos (tan - m), m between its least and its limit."""
    law = FRICTION_LAWS[name]
    tangent = 1.05 * law.limit
    trace = in_tilted_gravity(tangent, friction=law).lasting(2.0, 0.5).by(setting)
    pull = G / math.hypot(1.0, tangent)
    gained = np.diff(trace.v[1:, 0]) / 0.5  # without the start-up
    passed = np.linspace(trace.v[1, 0], trace.v[-1, 0], 100)
    least = pull * (tangent - law.limit)
    most = pull * (tangent - float(law.coefficient(passed).min()))
    beyond = max(1.0 - gained.min() / least, gained.max() / most - 1.0)
    what = f"acceleration outside its bounds, {name} at 1.05 of its limit"
    yield ExpectedValue(what, max(0.0, float(beyond)), 1e-9)


# --- HC07, HC10 ---------------------------------------------------------------------------------


def stopping(setting: SolverSetting, heading: float) -> Values:
    """Stop from 1 m/s: path, speed on the way, and no bend whatever the heading."""
    expected = answers("HC07")
    ahead = np.array([math.cos(heading), math.sin(heading)])
    # at 0.21 s the mass still has 4e-17 m/s: it has stopped
    trace = slider(0.0, velocity=(ahead[0], ahead[1])).lasting(0.21, 5e-3).by(setting)
    name = f"heading {heading:.3g} rad"
    path = relative((trace.q[:, :2] @ ahead)[-1], float(expected["x_stop"]))
    yield ExpectedValue(f"path, {name}", path, 1e-7)
    speeds = trace.v[:, :2] @ ahead
    errors = [
        relative(speeds[round(time / 5e-3)], float(expected[f"v({time})"])) for time in (0.1, 0.2)
    ]
    yield ExpectedValue(f"speed at 0.1 and 0.2 s, {name}", max(errors), 1e-7)
    aside = np.abs(trace.q[:, :2] @ np.array([-ahead[1], ahead[0]])).max()
    yield ExpectedValue(f"bend of the path, {name}", float(aside), 1e-10, "m")


def across_a_slope(setting: SolverSetting, heading: float | None) -> Values:
    """Thrown across a slope; heading None: level ground under tilted gravity."""
    expected = answers("HC10")
    if heading is None:
        run, angle = in_tilted_gravity(0.3, (0.0, 1.0)), 0.0
    else:
        run, angle = slider(0.3, heading, (0.0, 1.0)), math.atan(0.3)
    trace = run.by(setting)
    down, across, out = downhill(heading or 0.0, angle)
    moved, speed = trace.q[-1, :3] - trace.q[0, :3], trace.v[-1, :3]
    errors = (
        relative(float(moved @ down), expected["x"]),
        relative(float(moved @ across), expected["y"]),
        relative(float(speed @ down), expected["vx"]),
    )  # fmt: skip
    name = "gravity tilted" if heading is None else f"heading {heading:g} rad"
    yield ExpectedValue(f"x, y, creep at 1 s; {name}", max(errors), 1e-7)
    yield ExpectedValue(f"rise off the slope, {name}", abs(float(moved @ out)), 1e-12, "m")
    if heading is None:
        aside = abs(float(speed @ across))
        yield ExpectedValue(f"speed across at 1 s, {name}", aside, 1e-12, "m/s")


# --- HC30 ---------------------------------------------------------------------------------------

ROLLING_ANGLE = math.radians(15.0)
RADIUS = 0.05
"""[m]"""


def rolling(setting: SolverSetting, heading: float) -> Values:
    """A sphere rolls down 15 degrees; its slip decays at 3.5 mu g kt cos = 1.7e4 1/s."""
    import pinocchio as pin

    robot = ball(RADIUS, inertia=0.4 * RADIUS**2)
    down, across, out = downhill(heading, ROLLING_ANGLE)
    start = state(robot, (RADIUS - static_depth(ROLLING_ANGLE)) * out)
    terrain = Slope(angle=-ROLLING_ANGLE, heading=heading)
    scene = on_ground(robot, ELASTIC, friction=TANH, terrain=terrain)
    trace = CaseRun(scene, start, 0.4, 0.1).by(setting)
    turn = [pin.Quaternion(q[3:7]).matrix() for q in trace.q]
    speed = np.array([r @ v[:3] @ down for r, v in zip(turn, trace.v, strict=True)])
    spin = np.array([r @ v[3:6] @ across for r, v in zip(turn, trace.v, strict=True)])
    expected = answers("HC30")
    slip = float(expected["slip_speed_steady=atanh(2 tan/(7 mu))/k"])
    name = f"heading {heading:g} rad"
    error = relative(speed[-1] - RADIUS * spin[-1], slip)
    yield ExpectedValue(f"slip speed, {name}", error, 1e-6)
    gained = (speed[-1] - speed[1]) / (trace.time[-1] - trace.time[1])
    error = relative(gained, float(expected["accel=5/7 g sin"]))
    yield ExpectedValue(f"acceleration, {name}", error, 1e-6)
    aside = abs(float((trace.q[-1, :3] - trace.q[0, :3]) @ across))
    yield ExpectedValue(f"path across, {name}", aside, 1e-12, "m")


_SLOPES = ("0.25", "0.49", "0.4999")
_TANGENTS = tuple((t, False) for t in dict.fromkeys((*_SLOPES, *answers("HC06")["below_mu"])))
LONG_STEPS = SolverSetting("extrapolated-euler", 1e-6)
"""Its steps pass over samples: they are as long as these slow motions let them be."""

_SLIDING = ((0.5, "at_mu_v(1s)"), (0.51, "tan=0.51_v(1s)"))

CASES = (
    HardCase("HC06", "sticking by regularised friction creeps: exact creep speed", (
        Trial(creep, (DOP853, IMPLICIT_1MS, NDF, EXTRAPOLATED_EULER), variants=_TANGENTS,
              quick_settings=2, quick_variants=3),
        Trial(creep, (IMPLICIT_1MS, LONG_STEPS), variants=[(t, True) for t in _SLOPES],
              quick_settings=2),
        Trial(sliding, TIGHT, (EXTRAPOLATED_EULER,), [(*s, False) for s in _SLIDING]),
        Trial(sliding, (rk4(5e-5),), variants=[(*s, True) for s in _SLIDING]),
        Trial(creep_of_law, (IMPLICIT_1MS,),
              variants=list(product(FRICTION_LAWS, (0.05, 0.5, 0.95)))),
        Trial(sliding_of_law, (LONG_STEPS,), variants=[(name,) for name in FRICTION_LAWS]),
    )),
    HardCase("HC07", "stopping: slip decays at 4905 1/s, isotropy", (
        Trial(stopping, (rk4(2e-5), *REFERENCE), variants=((0.0,), (math.atan2(0.8, 0.6),)),
              quick_settings=2),
    )),
    HardCase("HC10", "friction split per axis", (
        Trial(across_a_slope, (rk4(2e-5), *REFERENCE), variants=((0.0,), (2.2,), (None,)),
              quick_settings=2),
    )),
    HardCase("HC30", "friction at the contact point of a rolling sphere", (
        Trial(rolling, (rk4(1e-5), *TIGHT), (EXTRAPOLATED_EULER,),
              ((0.0,), (-1.3,)), quick_settings=2),
    )),
)  # fmt: skip
