"""HC06, HC07, HC10, HC30: friction on planes, level and inclined."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.ground.contact import HuntCrossley, TanhCoulomb
from hexapod_pin.ground.terrain import Slope
from hexapod_pin.robot.robot import Robot
from hexapod_pin.robot.state import State
from hexapod_pin.validation.cases.bodies import ball, on_ground, particle, state
from hexapod_pin.validation.cases.case_result import HardCase, HardRow, relative
from hexapod_pin.validation.cases.reference_data import G, answers
from hexapod_pin.validation.cases.solver_settings import (
    MILLISECOND,
    TIGHT,
    Run,
    Wanted,
    measured,
    ways,
)

ELASTIC = HuntCrossley(stiffness=1e6)
TANH = TanhCoulomb(mu=0.5, slope=1000.0)


def downhill(heading: float, angle: float) -> tuple[Array, Array, Array]:
    """Return unit vectors down a slope that falls along `heading`, across it (left), and out."""
    import pinocchio as pin

    turn = pin.rpy.rpyToMatrix(0.0, angle, heading)
    return turn[:, 0], turn[:, 1], turn[:, 2]


def static_depth(angle: float) -> float:
    """Return the depth at which 1 kg rests on a slope [m]."""
    return float((G * math.cos(angle) / ELASTIC.stiffness) ** (2.0 / 3.0))


def _slider(tangent: float, heading: float, velocity: Array) -> Run:
    """Return a particle on a slope falling along `heading`; `velocity` down, across."""
    angle = math.atan(tangent)
    down, across, out = downhill(heading, angle)
    robot = particle()
    start = state(robot, -static_depth(angle) * out, velocity[0] * down + velocity[1] * across)
    terrain = Slope(angle=-angle, heading=heading)
    scene = on_ground(robot, ELASTIC, friction=TANH, terrain=terrain)
    return Run(scene, start, 1.0)


def _again(run: Run, duration: float, sample: float | None = None) -> Run:
    return Run(run.scene, run.start, duration, sample)


# --- HC06 ---------------------------------------------------------------------------------------


def hc06(quick: bool) -> Iterator[HardRow]:
    """Creep below the friction angle, sliding at and above it."""
    for way in (*ways(quick), *ways(quick, MILLISECOND)):
        for tangent in ("0.25", "0.49", "0.4999") if quick else answers("HC06")["below_mu"]:
            look = partial(_creep, tangent)
            yield from measured("HC06", f"creep at tan {tangent}", way, look, required=TIGHT)
    for way in ways(quick):
        for tangent, key in ((0.5, "at_mu_v(1s)"), (0.51, "tan=0.51_v(1s)")):
            look = partial(_slide, tangent, key)
            yield from measured("HC06", f"tan {tangent}", way, look, required=TIGHT)


def _creep(tangent: str, way: Setting) -> Iterator[Wanted]:
    run = _slider(float(tangent), 0.0, np.zeros(2))
    trace = _again(run, 15.0).by(way)
    wanted = float(answers("HC06")["below_mu"][tangent]["creep_speed"])
    speed = float(np.linalg.norm(trace.v[-1, :3]))
    yield Wanted(f"creep speed after 15 s, tan {tangent}", relative(speed, wanted), 1e-6)


def _slide(tangent: float, key: str, way: Setting) -> Iterator[Wanted]:
    trace = _slider(tangent, 0.0, np.zeros(2)).by(way)
    speed = float(np.linalg.norm(trace.v[-1, :3]))
    wanted = float(answers("HC06")[key])
    yield Wanted(f"speed after 1 s, tan {tangent:g}", relative(speed, wanted), 1e-6)


# --- HC07 ---------------------------------------------------------------------------------------


def hc07(quick: bool) -> Iterator[HardRow]:
    """Stop from 1 m/s: path, speed on the way, and no bend whatever the heading."""
    for way in ways(quick):
        for heading in (0.0, math.atan2(0.8, 0.6)):
            look = partial(_stop, heading)
            yield from measured("HC07", f"heading {heading:.3g}", way, look, required=TIGHT)


def _stop(heading: float, way: Setting) -> Iterator[Wanted]:
    wanted = answers("HC07")
    ahead = np.array([math.cos(heading), math.sin(heading)])
    run = _slider(0.0, 0.0, ahead)
    trace = _again(run, 0.21, 5e-3).by(way)
    path = trace.q[:, :2] @ ahead
    name = f"heading {heading:.3g} rad"
    yield Wanted(f"path, {name}", relative(path[-1], float(wanted["x_stop"])), 1e-7)
    speeds = trace.v[:, :2] @ ahead
    errors = [
        relative(speeds[round(time / 5e-3)], float(wanted[f"v({time})"])) for time in (0.1, 0.2)
    ]
    yield Wanted(f"speed at 0.1 and 0.2 s, {name}", max(errors), 1e-7)
    aside = np.abs(trace.q[:, :2] @ np.array([-ahead[1], ahead[0]])).max()
    yield Wanted(f"bend of the path, {name}", float(aside), 1e-10, "m")


# --- HC10 ---------------------------------------------------------------------------------------


def hc10(quick: bool) -> Iterator[HardRow]:
    """Thrown across a slope."""
    for way in ways(quick):
        for heading in (0.0, 2.2):
            look = partial(_across, heading)
            yield from measured("HC10", f"heading {heading:g}", way, look, required=TIGHT)


def _across(heading: float, way: Setting) -> Iterator[Wanted]:
    wanted = answers("HC10")
    run = _slider(0.3, heading, np.array([0.0, 1.0]))
    trace = run.by(way)
    down, across, _ = downhill(heading, math.atan(0.3))
    moved = trace.q[-1, :3] - trace.q[0, :3]
    errors = (
        relative(float(moved @ down), wanted["x"]),
        relative(float(moved @ across), wanted["y"]),
        relative(float(trace.v[-1, :3] @ down), wanted["vx"]),
    )  # fmt: skip
    yield Wanted(f"x, y, creep at 1 s; heading {heading:g} rad", max(errors), 1e-7)


# --- HC30 ---------------------------------------------------------------------------------------

ROLLING = math.radians(15.0)
RADIUS = 0.05


def hc30(quick: bool) -> Iterator[HardRow]:
    """A sphere rolls down 15 degrees."""
    for way in ways(quick):
        for heading in (0.0, -1.3):
            look = partial(_rolling, heading)
            yield from measured("HC30", f"heading {heading:g}", way, look, required=TIGHT)


def _roller(heading: float) -> tuple[Robot, State]:
    robot = ball(RADIUS, inertia=0.4 * RADIUS**2)
    out = downhill(heading, ROLLING)[2]
    return robot, state(robot, (RADIUS - static_depth(ROLLING)) * out)


def _rolling(heading: float, way: Setting) -> Iterator[Wanted]:
    import pinocchio as pin

    robot, start = _roller(heading)
    terrain = Slope(angle=-ROLLING, heading=heading)
    scene = on_ground(robot, ELASTIC, friction=TANH, terrain=terrain)
    trace = Run(scene, start, 0.4, 0.1).by(way)
    down, across, _ = downhill(heading, ROLLING)
    turn = [pin.Quaternion(q[3:7]).matrix() for q in trace.q]
    speed = np.array([r @ v[:3] @ down for r, v in zip(turn, trace.v, strict=True)])
    spin = np.array([r @ v[3:6] @ across for r, v in zip(turn, trace.v, strict=True)])
    wanted = answers("HC30")
    slip = float(wanted["slip_speed_steady=atanh(2 tan/(7 mu))/k"])
    name = f"heading {heading:g} rad"
    yield Wanted(f"slip speed, {name}", relative(speed[-1] - RADIUS * spin[-1], slip), 1e-6)
    gained = (speed[-1] - speed[1]) / (trace.time[-1] - trace.time[1])
    yield Wanted(f"acceleration, {name}", relative(gained, float(wanted["accel=5/7 g sin"])), 1e-6)


CASES = (
    HardCase("HC06", "sticking by regularised friction creeps: exact creep speed", hc06),
    HardCase("HC07", "stopping: slip decays at 4905 1/s, isotropy", hc07),
    HardCase("HC10", "friction split per axis", hc10),
    HardCase("HC30", "friction at the contact point of a rolling sphere", hc30),
)
