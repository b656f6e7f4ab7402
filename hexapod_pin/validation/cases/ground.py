"""HC25, HC27: a shaken table and a ledge."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.ground.contact import KelvinVoigt
from hexapod_pin.ground.terrain import Ledge, ShakingGround
from hexapod_pin.results.trace import Trace
from hexapod_pin.validation.cases.bodies import ball, on_ground, particle, state
from hexapod_pin.validation.cases.case_result import HardCase, HardRow, relative
from hexapod_pin.validation.cases.reference_data import G, answers
from hexapod_pin.validation.cases.solver_settings import (
    EXTRAPOLATED_EULER,
    TIGHT,
    Run,
    Wanted,
    measured,
    ways,
)

GROUND_WAYS = (Setting("dop853", 1e-10), Setting("ndf", 1e-10), EXTRAPOLATED_EULER)
"""K = 1e10 N/m yields 1 nm under the particle: less than extrapolated-euler resolves at 1e-8."""

# --- HC25 ---------------------------------------------------------------------------------------

AMPLITUDE, FREQUENCY = 2e-3, 12.0


def hc25(quick: bool) -> Iterator[HardRow]:
    """A particle on a table shaken at 1.16 g: take-off, landing, speed."""
    for way in ways(quick, GROUND_WAYS):
        for stiffness, damping in ((1e8, 2e3), (1e10, 2e4)):
            look = partial(_shaken, stiffness, damping)
            yield from measured("HC25", f"K {stiffness:g}", way, look, required=TIGHT)


def _shaken(stiffness: float, damping: float, way: Setting) -> Iterator[Wanted]:
    wanted, rate = answers("HC25"), 2.0 * math.pi * FREQUENCY
    normal = KelvinVoigt(stiffness=stiffness, damping=damping)
    robot = particle()
    terrain = ShakingGround(amplitude=AMPLITUDE, frequency=FREQUENCY)
    start = state(robot, (0.0, 0.0, -G / stiffness), (0.0, 0.0, AMPLITUDE * rate))
    trace = Run(on_ground(robot, normal, terrain=terrain), start, 0.045, 1e-5).by(way)
    pressed = trace.foot_force[:, 0, 2] > 0.0
    off = int(np.argmax(~pressed))
    on = off + int(np.argmax(pressed[off:]))
    table = AMPLITUDE * rate * math.cos(rate * trace.time[on - 1])
    name = f"K {stiffness:g} N/m"
    for what, at, key in (("take-off", off, "t_takeoff"), ("landing", on, "t_landing")):
        error = abs(trace.time[at] - float(wanted[key]))
        yield Wanted(f"time of {what}, {name}", error, 2e-4, "s")
    error = abs(table - trace.v[on - 1, 2] - float(wanted["impact_speed"]))
    yield Wanted(f"landing speed, {name}", error, 2e-4, "m/s", note="a sample of 10 us before")


# --- HC27 ---------------------------------------------------------------------------------------

RADIUS, SHELF = 0.02, 0.1
STIFF = KelvinVoigt(stiffness=1e10, damping=5e3)
"""1 nm under the particle."""


def hc27(quick: bool) -> Iterator[HardRow]:
    """A sphere slides off a shelf without friction."""
    for way in ways(quick, GROUND_WAYS):
        yield from measured("HC27", "leaves at once", way, _leaves, required=TIGHT)
        for heading in (2.5,) if quick else (0.0, 2.5):
            yield from measured("HC27", "rolls off", way, partial(_rolls, heading), required=TIGHT)


def over_the_edge(speed: float, duration: float, heading: float, way: Setting) -> Trace:
    """Return the trace of a sphere 1 mm before the edge, sliding towards it."""
    robot = ball(RADIUS)
    along = np.array([math.cos(heading), math.sin(heading), 0.0])
    high = np.array([0.0, 0.0, SHELF + RADIUS - G / STIFF.stiffness])
    start = state(robot, high - 1e-3 * along, speed * along)
    scene = on_ground(robot, STIFF, terrain=Ledge(height=SHELF, heading=heading))
    return Run(scene, start, duration, 1e-5).by(way)


def _leaves(way: Setting) -> Iterator[Wanted]:
    trace = over_the_edge(0.5, 0.144, 0.0, way)
    z, v = trace.q[-1, 2], trace.v[-1, :3]
    left = (v[2] + math.sqrt(v[2] ** 2 + 2.0 * G * (z - RADIUS))) / G  # a parabola from here
    place = trace.q[-1, 0] + left * v[0]
    wanted = float(answers("HC27")["v=0.5: centre x when centre is at z=r"])
    yield Wanted("where 0.5 m/s lands", relative(place, wanted), 1e-4)
    yield _kick(trace, "0.5 m/s")


def _rolls(heading: float, way: Setting) -> Iterator[Wanted]:
    trace = over_the_edge(0.2, 0.1, heading, way)
    key = "v=0.2: separation angle from vertical"
    [wanted] = [v for k, v in answers("HC27").items() if k.startswith(key)]
    error = relative(math.degrees(_parting(trace, heading)), float(wanted))
    yield Wanted(f"angle where 0.2 m/s parts, heading {heading:g} rad", error, 1e-4)
    yield _kick(trace, f"0.2 m/s, heading {heading:g} rad")


def _parting(trace: Trace, heading: float) -> float:
    """Return the angle at which the force, a line in the cosine, ends [rad]."""
    along = trace.q[:, 0] * math.cos(heading) + trace.q[:, 1] * math.sin(heading)
    angle = np.arctan2(along, trace.q[:, 2] - SHELF)
    cosine = np.cos(0.5 * (angle[1:] + angle[:-1]))  # a sampled force is the mean since the last
    force = np.linalg.norm(trace.foot_force[1:, 0], axis=1)
    late = (force > 0.05) & (force < 0.5) & (along[1:] > 1e-3)
    slope, offset = np.polyfit(cosine[late], force[late], 1)
    return math.acos(float(-offset / slope))


def _kick(trace: Trace, name: str) -> Wanted:
    energy = trace.energy["kinetic"] + trace.energy["potential"] + trace.energy["elastic"]
    return Wanted(
        f"energy gained at the edge, {name}", float((energy - energy[0]).max()), 1e-6, "J"
    )


CASES = (
    HardCase("HC25", "take-off and landing on a shaken table", hc25),
    HardCase("HC27", "an edge: flipping normals, kicks", hc27),
)
