"""HC01, HC03, HC04, HC24: a particle strikes the ground."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.ground.contact import AdamsImpact, Contact, HuntCrossley, KelvinVoigt, Restitution
from hexapod_pin.ground.contact.normal import NormalLaw
from hexapod_pin.ground.terrain import Flat
from hexapod_pin.validation.cases.bodies import on_ground, particle, state
from hexapod_pin.validation.cases.case_result import HardCase, HardRow, relative
from hexapod_pin.validation.cases.reference_data import G, answers, references
from hexapod_pin.validation.cases.solver_settings import (
    DOP853,
    EXTRAPOLATED_EULER,
    HIGH_ORDER,
    NDF,
    SMALL_STEPS,
    TIGHT,
    TRUTH,
    Run,
    Wanted,
    measured,
    ways,
)

if TYPE_CHECKING:
    from hexapod_pin.results.trace import Trace

SAMPLES = 400
"""Samples of a contact; the extremes between them come from cubics: 1e-10 of the extreme."""


@dataclass(frozen=True)
class Strike:
    """A particle that arrives at a speed, from a gap above level ground or at it.

    Attributes:
        law: normal law.
        mass: [kg].
        speed: downwards [m/s].
        duration: simulated time [s].
        gap: first height [m].
        gravity: downwards [m/s^2].
    """

    law: NormalLaw
    mass: float
    speed: float
    duration: float
    gap: float = 0.0
    gravity: float = 0.0

    def by(self, way: Setting, samples: int = SAMPLES) -> Trace:
        """Return the trace by a method."""
        robot = particle(self.mass)
        scene = on_ground(robot, self.law, gravity=(0.0, 0.0, -self.gravity))
        start = state(robot, (0.0, 0.0, self.gap), (0.0, 0.0, -self.speed))
        return Run(scene, start, self.duration, self.duration / samples).by(way)

    def extremes(self, trace: Trace) -> tuple[float, float]:
        """Return largest depth [m] and force [N], between the samples too."""
        from scipy.interpolate import CubicHermiteSpline

        depth, rate = -trace.foot_gap[:, 0], -trace.v[:, 2]
        force = self.law.force(depth, rate, self.speed)
        depths = CubicHermiteSpline(trace.time, depth, rate)
        rates = CubicHermiteSpline(trace.time, rate, self.gravity - force / self.mass)
        return (
            _largest(lambda t: float(depths(t)), trace.time, depth),
            _largest(
                lambda t: float(self.law.force(depths(t), rates(t), self.speed)), trace.time, force
            ),
        )


def _largest(function: Callable[[float], float], time: Array, samples: Array) -> float:
    """Return the maximum of a function near its largest sample."""
    from scipy.optimize import minimize_scalar

    k = int(samples.argmax())
    around = (time[max(k - 1, 0)], time[min(k + 1, len(time) - 1)])
    found = minimize_scalar(
        lambda t: -function(t), bounds=around, method="bounded", options={"xatol": 1e-12}
    )
    return -float(found.fun)


# --- HC01 ---------------------------------------------------------------------------------------

MODELS = {
    "lankarani_nikravesh_1990": "lankarani-nikravesh", "hunt_crossley_1975": "hunt-crossley",
    "flores_2011": "flores", "lee_wang_1983": "lee-wang",
    "herbert_mcwhannell_1977": "herbert-mcwhannell", "hu_guo_2015": "hu-guo",
}  # fmt: skip


def hc01(quick: bool) -> Iterator[HardRow]:
    """Restitution that six laws deliver, against the closed form."""
    table = references()["HC01_restitution_map"]["e_actual_vs_nominal"]
    for way in ways(quick, (SMALL_STEPS, *TRUTH)):
        for model, ours in list(MODELS.items())[: 1 if quick else None]:
            what = f"restitution of {ours}, asked for 0.1 to 0.9"
            asked = dict(list(table[model].items())[:: 2 if quick else 1])
            look = partial(_delivered, asked, ours, what)
            yield from measured("HC01", what, way, look, required=("rk4",))


def _delivered(table: dict[str, str], model: str, what: str, way: Setting) -> Iterator[Wanted]:
    errors = []
    for asked, wanted in table.items():
        given = {"stiffness": 1e4, "restitution": float(asked), "model": model}
        law = Restitution.model_validate(given)
        # a strongly damped foot leaves slowly: about depth/(e v) after the deepest point
        trace = Strike(law, 0.5, 1.0, 0.5, gap=1e-3).by(way, 1)
        errors.append(relative(trace.v[-1, 2], float(wanted)))
    yield Wanted(what, max(errors), 1e-8)


def hc01b(quick: bool) -> Iterator[HardRow]:
    """Restitution, depth, duration and peak force of one impact."""
    cases = answers("HC01b")
    for way in ways(quick):
        for name in ["n=1.5,c=0.3"] if quick else cases:
            for gap in (0.0, 1e-3):
                look = partial(_impact, {k: float(x) for k, x in cases[name].items()}, name, gap)
                yield from measured("HC01b", name, way, look, required=TIGHT)


def _impact(wanted: dict[str, float], name: str, gap: float, way: Setting) -> Iterator[Wanted]:
    exponent, asked = (float(part.split("=")[1]) for part in name.split(","))
    law = Restitution(
        stiffness=1e6, exponent=exponent, restitution=asked, model="lankarani-nikravesh"
    )
    strike = Strike(law, 0.5, 1.0, 1.1 * wanted["tc"] + gap, gap=gap)
    trace = strike.by(way)
    depth, force = strike.extremes(trace)
    rebound = trace.v[-1, 2]
    left = trace.time[-1] - trace.q[-1, 2] / rebound - gap  # straight without gravity
    errors = (
        relative(rebound, wanted["e"]), relative(depth, wanted["dmax"]),
        relative(left, wanted["tc"]), relative(force, wanted["Fpeak"]),
    )  # fmt: skip
    place = "from 1 mm above" if gap else "at touch"
    yield Wanted(f"e, depth, duration, peak force; {name}, {place}", max(errors), 1e-7)


def hc01c(quick: bool) -> Iterator[HardRow]:
    """Kelvin-Voigt: no tension at separation, a jump of the force at touch-down."""
    for way in ways(quick):
        for zeta, wanted in answers("HC01c").items():
            for gap in (-1e-14, 1e-3):
                look = partial(_kelvin_voigt, float(zeta), wanted, gap)
                yield from measured("HC01c", f"zeta {zeta}", way, look, required=HIGH_ORDER)


def _kelvin_voigt(
    zeta: float, wanted: dict[str, str], gap: float, way: Setting
) -> Iterator[Wanted]:
    stiffness, mass = 1e4, 0.5
    rate = math.sqrt(stiffness / mass)
    law = KelvinVoigt(stiffness=stiffness, damping=2.0 * zeta * mass * rate)
    trace = Strike(law, mass, 1.0, 4.0 / rate + max(gap, 0.0), gap=gap).by(way)
    place = "from 1 mm above" if gap > 0.0 else "at touch"
    error = relative(trace.v[-1, 2], float(wanted["e_no_tension"]))
    yield Wanted(f"restitution, zeta {zeta:g}, {place}", error, 1e-7)
    yield Wanted(f"tension, zeta {zeta:g}, {place}", max(0.0, -trace.foot_force.min()), 0.0, "N")
    if gap < 0.0:
        jump = trace.foot_force[0, 0, 2] / (mass * rate)
        error = relative(jump, float(wanted["initial_force_jump_over_m_v0_omega0"]))
        yield Wanted(f"force jump at touch, zeta {zeta:g}", error, 1e-7)


def hc01d(quick: bool) -> Iterator[HardRow]:
    """ADAMS IMPACT with S2's numbers, in SI."""
    for way in ways(quick):
        for name, wanted in answers("HC01d").items():
            look = partial(_adams, name, wanted)
            yield from measured("HC01d", name, way, look, required=TIGHT)


def _adams(name: str, wanted: dict[str, float], way: Setting) -> Iterator[Wanted]:
    mass, speed = (float(part.split("=")[1].rstrip("mkgs/")) for part in name.split(","))
    speed *= 1e-3
    law = Contact.s2().normal
    assert isinstance(law, AdamsImpact)
    strike = Strike(law, mass, speed, 1.1 * wanted["t_contact"] + 1e-6 / speed, gap=1e-6)
    trace = strike.by(way)
    depth, _ = strike.extremes(trace)
    errors = (
        relative(trace.v[-1, 2] / speed, wanted["e"]),
        relative(depth * 1e3, wanted["delta_max_mm"]),
    )
    yield Wanted(f"e, depth; {name}", max(errors), 1e-6)


# --- HC03, HC04 ---------------------------------------------------------------------------------


def hc03(quick: bool) -> Iterator[HardRow]:
    """A foot at rest rings for seconds, at a rate that no stiffness changes."""
    for way in ways(quick):
        yield from measured("HC03", "ringing", way, _ringing, required=HIGH_ORDER)
    yield HardRow(
        "HC03", "Zeno time of a rigid ball, e = 0.5", "-", math.nan, math.nan,
        note="a rigid impact: compliant contact has no Zeno time",
    )  # fmt: skip


def _ringing(way: Setting) -> Iterator[Wanted]:
    wanted = answers("HC03")
    static, rate = float(wanted["delta_static"]), float(wanted["omega_n=sqrt(1.5 g/delta_s)"])
    law = HuntCrossley(stiffness=1e6, dissipation=0.2)
    trace = Strike(law, 0.5, 0.0, 15.0, gap=-1.001 * static, gravity=G).by(way, 15000)
    yield Wanted("static depth", relative(-trace.foot_gap[-1, 0], static), 1e-9)
    ringing = trace.time < 3.0
    x, v = -trace.foot_gap[ringing, 0] - static, -trace.v[ringing, 2]
    decay = -np.polyfit(trace.time[ringing], np.log(np.hypot(x, v / rate)), 1)[0]
    yield Wanted(
        "decay of the ringing", relative(decay, float(wanted["decay_rate=0.75*a*g"])), 1e-3
    )
    phase = np.unwrap(np.arctan2(-v / rate, x))
    found = float(np.polyfit(trace.time[ringing], phase, 1)[0])
    yield Wanted("rate of the ringing", relative(found, rate), 1e-4, note="(decay/rate)^2/2 = 2e-5")


def hc04(quick: bool) -> Iterator[HardRow]:
    """Elastic bounces, K = 1e3 to 1e9, n = 1 and 1.5; one hundred of them."""
    cases = answers("HC04")
    for way in ways(quick, (DOP853, NDF)):
        for name in ["K=1e6,n=1.5", "K=1e9,n=1"] if quick else cases:
            wanted = {k: float(x) for k, x in cases[name].items()}
            yield from measured("HC04", name, way, partial(_one_bounce, wanted, name))
            yield from measured("HC04", name, way, partial(_bounces, wanted, name))
    if quick:
        return
    name = "K=1e6,n=1.5"
    wanted = {k: float(x) for k, x in cases[name].items()}
    yield from measured(
        "HC04", name, EXTRAPOLATED_EULER, partial(_one_bounce, wanted, name), required=TIGHT
    )
    yield from measured(
        "HC04", name, EXTRAPOLATED_EULER, partial(_bounces, wanted, name), required=TIGHT
    )


def _elastic(name: str) -> HuntCrossley:
    stiffness, exponent = (float(part.split("=")[1]) for part in name.split(","))
    return HuntCrossley(stiffness=stiffness, exponent=exponent)


def _one_bounce(wanted: dict[str, float], name: str, way: Setting) -> Iterator[Wanted]:
    speed = float(references()["HC04_elastic_bounce_stiffness_sweep"]["v_impact"])
    strike = Strike(_elastic(name), 0.5, speed, 1.1 * wanted["t_contact"], gravity=G)
    trace = strike.by(way)
    depth, force = strike.extremes(trace)
    rebound, z = trace.v[-1, 2], trace.q[-1, 2]
    left = trace.time[-1] - (math.sqrt(rebound**2 + 2.0 * G * z) - rebound) / G
    errors = (
        relative(depth, wanted["delta_max"]), relative(force, wanted["F_peak"]),
        relative(left, wanted["t_contact"]),
    )  # fmt: skip
    yield Wanted(f"depth, peak, duration; {name}", max(errors), 1e-6)


def _bounces(wanted: dict[str, float], name: str, way: Setting) -> Iterator[Wanted]:
    end = wanted["apex100_time"]
    trace = Strike(_elastic(name), 0.5, 0.0, end, gap=0.1, gravity=G).by(way, 1)
    height = trace.q[-1, 2] + trace.v[-1, 2] ** 2 / (2.0 * G)
    yield Wanted(f"apex after 100 bounces; {name}", relative(height, 0.1), 1e-6)
    late = trace.v[-1, 2] / G
    yield Wanted(f"time of apex 100; {name}", abs(late) / end, 1e-7)


# --- HC24 ---------------------------------------------------------------------------------------

LOWEST = (1e-12, 0.0, -1e-12, -1e-9)


def hc24(quick: bool) -> Iterator[HardRow]:
    """A foot whose path just touches the ground flies on as if nothing were there."""
    laws: dict[str, NormalLaw] = {
        "elastic": HuntCrossley(stiffness=1e6),
        "lankarani-nikravesh": Restitution(
            stiffness=1e6, restitution=0.3, model="lankarani-nikravesh"
        ),
        "adams": Contact.s2().normal,
    }
    for way in ways(quick):
        for name, law in laws.items():
            what = f"{name}: state after four arcs"
            yield from measured("HC24", what, way, partial(_grazing, law, what))


def _grazing(law: NormalLaw, what: str, way: Setting) -> Iterator[Wanted]:
    robot, half, apart = particle(0.5), 0.01, 0.0
    for lowest in LOWEST:  # an arc with its lowest point at the ground needs gravity upwards
        start = state(robot, (0.0, 0.0, lowest + 0.5 * G * half**2), (1.0, 0.0, -G * half))
        ends = []
        for height in (0.0, -1.0):  # the ground, and a ground out of reach
            scene = on_ground(robot, law, gravity=(0.0, 0.0, G), terrain=Flat(height=height))
            trace = Run(scene, start, 2.0 * half).by(way)
            ends.append(np.concatenate([trace.q[-1], trace.v[-1]]))
        apart = max(apart, float(np.abs(ends[0] - ends[1]).max()))
    yield Wanted(what, apart, 1e-10, "m, m/s")


CASES = (
    HardCase("HC01", "restitution that a law delivers, not the one it is asked for", hc01),
    HardCase("HC01b", "one impact: peak between samples, touch-down within a step", hc01b),
    HardCase("HC01c", "force jump at touch-down, adhesive pull at separation", hc01c),
    HardCase("HC01d", "units of S2's ADAMS numbers, stiff damping", hc01d),
    HardCase("HC03", "weakly damped ringing at rest", hc03),
    HardCase("HC04", "energy over 100 elastic bounces, contacts down to 0.07 ms", hc04),
    HardCase("HC24", "grazing: 0/0 at zero approach speed, events without end", hc24),
)
