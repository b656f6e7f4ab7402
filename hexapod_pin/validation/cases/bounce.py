"""HC03, HC04, HC24: a particle rings, bounces and grazes the ground."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from hexapod_pin.ground.contact import (
    Contact,
    HuntCrossley,
    NormalLaw,
    Restitution,
    TanhCoulomb,
)
from hexapod_pin.ground.terrain import Flat
from hexapod_pin.validation.case_result import ExpectedValue, relative
from hexapod_pin.validation.cases.bodies import on_ground, particle, state
from hexapod_pin.validation.cases.impact import Strike
from hexapod_pin.validation.cases.robots import G, answers, references
from hexapod_pin.validation.hard_case import HardCase, NotCovered, Trial
from hexapod_pin.validation.solver_setting import (
    DOP853,
    EXTRAPOLATED_EULER,
    REFERENCE,
    TIGHT,
    CaseRun,
    SolverSetting,
    rk4,
)

Values = Iterator[ExpectedValue]
IMPLICIT_1US = SolverSetting("implicit-euler", 1e-6)

# --- HC03, HC04 ---------------------------------------------------------------------------------


def ringing(setting: SolverSetting) -> Values:
    """A foot at rest rings for seconds, at a rate that no stiffness changes."""
    expected = answers("HC03")
    static, rate = float(expected["delta_static"]), float(expected["omega_n=sqrt(1.5 g/delta_s)"])
    law = HuntCrossley(stiffness=1e6, dissipation=0.2)
    trace = Strike(law, 0.5, 0.0, 15.0, gap=-1.001 * static, gravity=G).by(setting, 15000)
    yield ExpectedValue("static depth", relative(-trace.foot_gap[-1, 0], static), 1e-9)
    early = trace.time < 3.0
    x, v = -trace.foot_gap[early, 0] - static, -trace.v[early, 2]
    decay = -np.polyfit(trace.time[early], np.log(np.hypot(x, v / rate)), 1)[0]
    error = relative(decay, float(expected["decay_rate=0.75*a*g"]))
    yield ExpectedValue("decay of the ringing", error, 1e-3)
    phase = np.unwrap(np.arctan2(-v / rate, x))
    found = float(np.polyfit(trace.time[early], phase, 1)[0])
    note = "(decay/rate)^2/2 = 2e-5"
    yield ExpectedValue("rate of the ringing", relative(found, rate), 1e-4, note=note)


def elastic_bounce(setting: SolverSetting | None, name: str) -> Values:
    """Depth, peak, duration of one contact; without a setting rk4 in 4000 steps."""
    expected = {k: float(x) for k, x in answers("HC04")[name].items()}
    speed = float(references()["HC04_elastic_bounce_stiffness_sweep"]["v_impact"])
    step = float(f"{expected['t_contact'] / 4000:.3g}")
    duration = 1.1 * expected["t_contact"] if setting else 4200 * step
    strike = Strike(_elastic(name), 0.5, speed, duration, gravity=G)
    trace = strike.by(setting) if setting else strike.by(rk4(step), 4200)
    depth, force = strike.extremes(trace)
    rebound, z = trace.v[-1, 2], trace.q[-1, 2]
    left = trace.time[-1] - (math.sqrt(rebound**2 + 2.0 * G * z) - rebound) / G
    errors = (
        relative(depth, expected["delta_max"]), relative(force, expected["F_peak"]),
        relative(left, expected["t_contact"]), relative(z + rebound**2 / (2.0 * G), 0.1),
    )  # fmt: skip
    yield ExpectedValue(f"depth, peak, duration, energy; {name}", max(errors), 1e-6)


def _elastic(name: str) -> HuntCrossley:
    stiffness, exponent = (float(part.split("=")[1]) for part in name.split(","))
    return HuntCrossley(stiffness=stiffness, exponent=exponent)


def hundred_bounces(setting: SolverSetting, name: str) -> Values:
    """Height and time of the apex after 100 bounces."""
    end = float(answers("HC04")[name]["apex100_time"])
    trace = Strike(_elastic(name), 0.5, 0.0, end, gap=0.1, gravity=G).by(setting, 1)
    height = trace.q[-1, 2] + trace.v[-1, 2] ** 2 / (2.0 * G)
    yield ExpectedValue(f"apex after 100 bounces; {name}", relative(height, 0.1), 1e-6)
    late = trace.v[-1, 2] / G
    yield ExpectedValue(f"time of apex 100; {name}", abs(late) / end, 1e-7)


def bounces_at_small_steps(_: None, name: str, step: float, bounces: int) -> Values:
    """Energy every millisecond, height and time of an apex, by rk4."""
    end = bounces * float(answers("HC04")[name]["period"])
    samples = round(1e3 * (round(end, 3) + 1e-3))
    strike = Strike(_elastic(name), 0.5, 0.0, 1e-3 * samples, gap=0.1, gravity=G)
    trace = strike.by(rk4(step), samples)
    energy = trace.energy["kinetic"] + trace.energy["potential"] + trace.energy["elastic"]
    what = f"{bounces} bounces; {name}, {rk4(step)}"
    yield ExpectedValue(f"energy, {what}", float(np.abs(energy / energy[0] - 1.0).max()), 1e-6)
    late = int(np.argmin(np.abs(trace.time - end)))  # in flight, near the apex
    height = trace.q[late, 2] + trace.v[late, 2] ** 2 / (2.0 * G)
    yield ExpectedValue(f"apex after {what}", relative(height, 0.1), 1e-6)
    error = relative(trace.time[late] + trace.v[late, 2] / G, end)
    yield ExpectedValue(f"time of the apex after {what}", error, 1e-7)


# --- HC24 ---------------------------------------------------------------------------------------

LOWEST_POINTS = (1e-12, 0.0, -1e-12, -1e-9)
"""Of the arcs, above the ground [m]."""

SMOOTH_LAWS: dict[str, NormalLaw] = {
    "elastic": HuntCrossley(stiffness=1e6),
    "hunt-crossley": HuntCrossley(stiffness=1e6, dissipation=20.0),
    "lankarani-nikravesh": Restitution(stiffness=1e6, restitution=0.3, model="lankarani-nikravesh"),
    "exact": Restitution(stiffness=1e6, restitution=0.3),
    "adams": Contact.s2().normal,
}
"""Kelvin-Voigt is left out: its force jumps at any touch."""


def grazing(setting: SolverSetting, name: str, step_ends_there: bool) -> Values:
    """A foot whose path just touches the ground flies on as if nothing were there."""
    robot, half, apart = particle(0.5), 0.01, 0.0
    friction = TanhCoulomb(mu=0.5, slope=1000.0)
    for lowest in LOWEST_POINTS:  # an arc with its lowest point at the ground: gravity upwards
        start = state(robot, (0.0, 0.0, lowest + 0.5 * G * half**2), (1.0, 0.0, -G * half))
        ends = []
        for height in (0.0, -1.0):  # the ground, and a ground out of reach
            scene = on_ground(
                robot, SMOOTH_LAWS[name], friction=friction, gravity=(0.0, 0.0, G),
                terrain=Flat(height=height),
            )  # fmt: skip
            sample = half if step_ends_there else None
            trace = CaseRun(scene, start, 2.0 * half, sample).by(setting)
            ends.append(np.concatenate([trace.q[-1], trace.v[-1]]))
        apart = max(apart, float(np.abs(ends[0] - ends[1]).max()))
    what = f"{name}: state after four arcs{', a step ends at the ground' * step_ends_there}"
    yield ExpectedValue(what, apart, 1e-10, "m, m/s")


_TYPICAL = ("K=1e6,n=1.5", "K=1e9,n=1")
_SWEEP = tuple((name,) for name in dict.fromkeys((*_TYPICAL, *answers("HC04"))))
"""The first two are those of a quick run."""

CASES = (
    HardCase("HC03", "weakly damped ringing at rest", (
        Trial(ringing, (DOP853, rk4(2e-4)), REFERENCE[1:], quick_settings=2),
        NotCovered("Zeno time of a rigid ball, e = 0.5",
                   "a rigid impact: compliant contact has no Zeno time"),
    )),
    HardCase("HC04", "energy over 100 elastic bounces, contacts down to 0.07 ms", (
        Trial(elastic_bounce, TIGHT, variants=_SWEEP, quick_variants=2),
        Trial(hundred_bounces, TIGHT, variants=_SWEEP, quick_variants=2),
        Trial(elastic_bounce, (EXTRAPOLATED_EULER,), variants=_SWEEP[:1], quick_settings=0),
        Trial(hundred_bounces, (), (EXTRAPOLATED_EULER,), _SWEEP[:1]),
        Trial(elastic_bounce, (None,), variants=_SWEEP, label="rk4, 4000 steps"),
        Trial(bounces_at_small_steps, (None,), slow=True, label="rk4", variants=(
            ("K=1e3,n=1.5", 5e-5, 30), ("K=1e5,n=1", 5e-6, 10), ("K=1e6,n=1.5", 2e-5, 100),
            ("K=1e9,n=1.5", 1e-6, 2),
        )),
    )),
    HardCase("HC24", "grazing: 0/0 at zero approach speed, events without end", (
        Trial(grazing, REFERENCE, variants=[(name, False) for name in SMOOTH_LAWS]),
        Trial(grazing, TIGHT, (EXTRAPOLATED_EULER,),
              [(name, True) for name in SMOOTH_LAWS]),
        Trial(grazing, (rk4(1e-6), IMPLICIT_1US),
              variants=[(name, True) for name in SMOOTH_LAWS], slow=True),
    )),
)  # fmt: skip
