"""HC01: a particle strikes the ground."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

from hexapod_pin.arrays import Array
from hexapod_pin.ground.contact import (
    AdamsImpact,
    Contact,
    KelvinVoigt,
    NormalLaw,
    Restitution,
)
from hexapod_pin.validation.case_result import ExpectedValue, relative
from hexapod_pin.validation.cases.bodies import on_ground, particle, state
from hexapod_pin.validation.cases.robots import answers, references
from hexapod_pin.validation.hard_case import HardCase, Trial
from hexapod_pin.validation.solver_setting import (
    DOP853,
    EXTRAPOLATED_EULER,
    NDF,
    REFERENCE,
    TIGHT,
    CaseRun,
    SolverSetting,
    rk4,
)

if TYPE_CHECKING:
    from hexapod_pin.results.trace import Trace

Values = Iterator[ExpectedValue]

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

    def by(self, setting: SolverSetting, samples: int = SAMPLES) -> Trace:
        """Return the trace by a method."""
        robot = particle(self.mass)
        scene = on_ground(robot, self.law, gravity=(0.0, 0.0, -self.gravity))
        start = state(robot, (0.0, 0.0, self.gap), (0.0, 0.0, -self.speed))
        return CaseRun(scene, start, self.duration, self.duration / samples).by(setting)

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


def parabola_top(samples: Array) -> float:
    """Return the maximum of the parabola through the largest sample and its neighbours."""
    i = int(samples.argmax())
    before, at, after = samples[i - 1 : i + 2]
    return float(at - (before - after) ** 2 / (8.0 * (before - 2.0 * at + after)))


# --- HC01 ---------------------------------------------------------------------------------------

MODELS = {
    "lankarani_nikravesh_1990": "lankarani-nikravesh", "hunt_crossley_1975": "hunt-crossley",
    "flores_2011": "flores", "lee_wang_1983": "lee-wang",
    "herbert_mcwhannell_1977": "herbert-mcwhannell", "hu_guo_2015": "hu-guo",
}  # fmt: skip


def catalogue_restitution(setting: SolverSetting, model: str, every: int) -> Values:
    """Restitution of a law asked for 0.1 to 0.9 against the catalogue."""
    table = references()["HC01_restitution_map"]["e_actual_vs_nominal"][model]
    ours, errors = MODELS[model], []
    for asked, expected in list(table.items())[::every]:
        given = {"stiffness": 1e4, "restitution": float(asked), "model": ours}
        law = Restitution.model_validate(given)
        # a strongly damped foot leaves slowly: about depth/(e v) after the deepest point
        trace = Strike(law, 0.5, 1.0, 0.5, gap=1e-3).by(setting, 1)
        errors.append(relative(trace.v[-1, 2], float(expected)))
    yield ExpectedValue(f"restitution of {ours}, asked for 0.1 to 0.9", max(errors), 1e-8)


def delivered_restitution(setting: SolverSetting, model: str, asked: float) -> Values:
    """Restitution against the law's own closed form; of the exact law, what was asked for."""
    given = {"stiffness": 1e6, "restitution": asked, "model": model}
    law = Restitution.model_validate(given)
    trace = Strike(law, 0.5, 0.2, 0.12, gap=3.3e-6).by(setting, 1)
    found = trace.v[-1, 2] / 0.2 if trace.foot_gap[-1, 0] > 0.0 else math.nan
    yield ExpectedValue(f"restitution delivered by {model}", relative(found, law.delivered), 1e-7)
    if model == "exact":
        yield ExpectedValue(f"restitution asked for, {asked:g}", relative(found, asked), 1e-7)


# --- HC01b --------------------------------------------------------------------------------------


def one_impact(setting: SolverSetting | None, name: str, gap: float) -> Values:
    """Restitution, depth, duration and peak force; without a setting rk4 in 4000 steps."""
    expected = {k: float(x) for k, x in answers("HC01b")[name].items()}
    exponent, asked = (float(part.split("=")[1]) for part in name.split(","))
    law = Restitution(
        stiffness=1e6, exponent=exponent, restitution=asked, model="lankarani-nikravesh"
    )
    place = f"{name}, from {gap:g} m" if setting else f"{name}, from {gap:g} steps above"
    if setting is None:
        step = float(f"{expected['tc'] / 4000:.3g}")
        gap *= step
        strike = Strike(law, 0.5, 1.0, 4400 * step, gap=gap)
        trace = strike.by(rk4(step), 4400)
        recorded = parabola_top(trace.foot_force[:, 0, 2])
        yield ExpectedValue(
            f"recorded peak force, {place}", relative(recorded, expected["Fpeak"]), 3e-7
        )
    else:
        strike = Strike(law, 0.5, 1.0, 1.1 * expected["tc"] + gap, gap=gap)
        trace = strike.by(setting)
    depth, force = strike.extremes(trace)
    rebound = trace.v[-1, 2]
    left = trace.time[-1] - trace.q[-1, 2] / rebound - gap  # straight without gravity
    errors = (
        relative(rebound, expected["e"]), relative(depth, expected["dmax"]),
        relative(left, expected["tc"]), relative(force, expected["Fpeak"]),
    )  # fmt: skip
    yield ExpectedValue(f"e, depth, duration, peak force; {place}", max(errors), 1e-7)


# --- HC01c, HC01d -------------------------------------------------------------------------------

LINEAR_STIFFNESS, LINEAR_MASS = 1e4, 0.5
LINEAR_RATE = math.sqrt(LINEAR_STIFFNESS / LINEAR_MASS)
"""HC01c: [N/m], [kg], [rad/s]."""


def _struck_linearly(setting: SolverSetting, zeta: str, gap: float) -> tuple[Trace, str]:
    damping = 2.0 * float(zeta) * LINEAR_MASS * LINEAR_RATE
    law = KelvinVoigt(stiffness=LINEAR_STIFFNESS, damping=damping)
    steps = round((4.0 / LINEAR_RATE + max(gap, 0.0)) / KELVIN_VOIGT_STEP)
    strike = Strike(law, LINEAR_MASS, 1.0, steps * KELVIN_VOIGT_STEP, gap=gap)
    place = f"zeta {zeta}, {'from 1 mm above' if gap > 0.0 else 'at touch'}"
    return strike.by(setting, steps), place


def linear_restitution(setting: SolverSetting, zeta: str, gap: float) -> Values:
    """Restitution of a spring and damper that does not pull."""
    trace, place = _struck_linearly(setting, zeta, gap)
    error = relative(trace.v[-1, 2], float(answers("HC01c")[zeta]["e_no_tension"]))
    yield ExpectedValue(f"restitution, {place}", error, 1e-7)


def no_tension(setting: SolverSetting, zeta: str, gap: float) -> Values:
    """No sample of the force pulls."""
    trace, place = _struck_linearly(setting, zeta, gap)
    yield ExpectedValue(f"tension, {place}", max(0.0, -trace.foot_force.min()), 0.0, "N")


def force_jump(setting: SolverSetting, zeta: str, gap: float) -> Values:
    """The force jumps to 2 zeta m v0 w0 at touch-down."""
    trace, place = _struck_linearly(setting, zeta, gap)
    jump = trace.foot_force[0, 0, 2] / (LINEAR_MASS * LINEAR_RATE)
    expected = float(answers("HC01c")[zeta]["initial_force_jump_over_m_v0_omega0"])
    yield ExpectedValue(f"force jump, {place}", relative(jump, expected), 1e-7)


KELVIN_VOIGT_STEP = 5.66e-6
"""Of rk4, and between samples [s]: 0.8e-3 of LINEAR_RATE's radian."""


def adams_impact(setting: SolverSetting, name: str, gap: float) -> Values:
    """ADAMS IMPACT with S2's numbers, in SI."""
    expected = answers("HC01d")[name]
    mass, speed = (float(part.split("=")[1].rstrip("mkgs/")) for part in name.split(","))
    speed *= 1e-3
    law = Contact.s2().normal
    assert isinstance(law, AdamsImpact)
    samples = math.ceil(1e6 * (1.1 * expected["t_contact"] + gap / speed))
    strike = Strike(law, mass, speed, 1e-6 * samples, gap=gap)
    trace = strike.by(setting, samples)
    depth, _ = strike.extremes(trace)
    errors = (
        relative(trace.v[-1, 2] / speed, expected["e"]),
        relative(depth * 1e3, expected["delta_max_mm"]),
    )
    yield ExpectedValue(f"e, depth; {name}, from {gap:g} m", max(errors), 1e-6)


_BOTH_GAPS = tuple(product(answers("HC01c"), (-1e-14, 1e-3)))
_AT_TOUCH = _BOTH_GAPS[::2]
_IMPACTS = ("n=1.5,c=0.3", *(name for name in answers("HC01b") if name != "n=1.5,c=0.3"))
"""The first is that of a quick run."""

CASES = (
    HardCase("HC01", "restitution that a law delivers, not the one it is asked for", (
        Trial(catalogue_restitution, (rk4(2e-5), *TIGHT), (EXTRAPOLATED_EULER,),
              [(model, 1) for model in MODELS], quick_variants=1),
        Trial(delivered_restitution, (rk4(1e-5),),
              variants=list(product(("exact", "flores", "hunt-crossley", "gonthier"),
                                    (0.1, 0.5, 0.9)))),
    )),
    HardCase("HC01b", "one impact: peak between samples, touch-down within a step", (
        Trial(one_impact, TIGHT, (EXTRAPOLATED_EULER,),
              list(product(_IMPACTS, (0.0, 1e-3))), quick_variants=2),
        Trial(one_impact, (None,), variants=list(product(_IMPACTS, (0.0, 0.37))),
              label="rk4, 4000 steps"),
    )),
    HardCase("HC01c", "force jump at touch-down, adhesive pull at separation", (
        Trial(linear_restitution, TIGHT, (EXTRAPOLATED_EULER,), _BOTH_GAPS),
        Trial(no_tension, (DOP853, EXTRAPOLATED_EULER), (NDF,),
              _BOTH_GAPS),
        Trial(force_jump, REFERENCE, variants=_AT_TOUCH),
        # at touch alone: a fixed step that meets the jump in its middle is of order 1
        *(Trial(run, (rk4(KELVIN_VOIGT_STEP),), variants=_AT_TOUCH)
          for run in (linear_restitution, no_tension, force_jump)),
    )),
    HardCase("HC01d", "units of S2's ADAMS numbers, stiff damping", (
        Trial(adams_impact, TIGHT, (EXTRAPOLATED_EULER,),
              [(name, 1e-6) for name in answers("HC01d")]),
        Trial(adams_impact, (rk4(1e-6),), variants=[(name, 1e-9) for name in answers("HC01d")]),
    )),
)  # fmt: skip
