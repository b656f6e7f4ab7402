"""Normal forces by the formulas of the laws' sources, written apart from the native core.

Each law is a spring K d^n with a resistance in the approach rate d', clamped at zero; here without
the clamp, and with a number that is positive where the clamp does not act.
"""

from __future__ import annotations

import math

from scipy.optimize import brentq

from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact.normal import AdamsImpact, HuntCrossley, KelvinVoigt, NormalLaw
from hexapod_pin.ground.contact.restitution import Restitution


def restitution_damping(model: str, e: float) -> float:
    """Return a(e) of f = K d^n (1 + a d'/v0) for a restitution e asked for [-].

    Hunt & Crossley 1975, Herbert & McWhannell 1977, Lee & Wang 1983, Lankarani & Nikravesh 1990,
    Gonthier et al. 2004, Zhiying & Qishao 2006, Flores et al. 2011, Gharib & Hurmuzlu 2012, Hu &
    Guo 2015; "exact" solves m v dv = -K d^n (1 + a v/v0) dd, that is
    ln((1 + a)/(1 - a e)) = a (1 + e), 0 < a e < 1.

    Raises:
        ParameterError: another model.
    """
    if model == "exact":
        return _exact(e)
    found = {
        "hunt-crossley": 3.0 * (1.0 - e) / 2.0,
        "herbert-mcwhannell": 6.0 * (1.0 - e) / ((2.0 * e - 1.0) ** 2 + 3.0),
        "lee-wang": 3.0 * (1.0 - e) / 4.0,
        "lankarani-nikravesh": 3.0 * (1.0 - e**2) / 4.0,
        "gonthier": (1.0 - e**2) / e,
        "zhiying-qishao": 3.0 * (1.0 - e**2) * math.exp(2.0 * (1.0 - e)) / 4.0,
        "flores": 8.0 * (1.0 - e) / (5.0 * e),
        "gharib-hurmuzlu": 1.0 / e,
        "hu-guo": 3.0 * (1.0 - e) / (2.0 * e),
    }
    if model not in found:
        raise ParameterError("Restitution.model", model, ", ".join((*found, "exact")))
    return found[model]


def _exact(e: float) -> float:
    if e == 1.0:
        return 0.0

    def remainder(a: float) -> float:
        return math.log1p(a) - math.log1p(-a * e) - a * (1.0 + e)

    low, high = 1e-4 * (1.0 - e), (1.0 - 1e-12) / e
    return float(brentq(remainder, low, high, xtol=1e-15, rtol=1e-15))


class NormalForce:
    """A normal law as a function of depth, approach rate and touch speed.

    Attributes:
        full_depth: depth at which the law's second derivative jumps [m]; None: none.
    """

    def __init__(self, law: NormalLaw) -> None:
        """Read the law's parameters.

        Raises:
            ParameterError: a law that is not written here.
        """
        self._stiffness, self._exponent = law.stiffness, law.exponent
        self._law = law
        self.full_depth = law.damping_depth if isinstance(law, AdamsImpact) else None
        if isinstance(law, HuntCrossley):
            self._gain = 3.0 / 2.0 * law.dissipation
        elif isinstance(law, Restitution):
            self._gain = restitution_damping(law.model, law.restitution)
        elif not isinstance(law, KelvinVoigt | AdamsImpact):
            raise ParameterError("Contact.normal", type(law).__name__, "a law with its own formula")

    def __call__(
        self, depth: float, rate: float, touch_speed: float, *, deep: bool
    ) -> tuple[float, float]:
        """Return the force without its clamp [N], and a number that is positive where it pushes.

        Args:
            depth: d [m]; below 0 as at 0.
            rate: d' [m/s].
            touch_speed: d' at first touch [m/s].
            deep: whether d is on the law's piece beyond `full_depth`.
        """
        law, spring = self._law, self._stiffness * max(depth, 0.0) ** self._exponent
        if isinstance(law, KelvinVoigt):
            force = spring + law.damping * rate
            return force, force
        if isinstance(law, AdamsImpact):
            force = spring + self._adams_damping(law, max(depth, 0.0), deep) * rate
            return force, force if deep else self._adams_push(law, max(depth, 0.0), rate)
        gain = self._gain
        if isinstance(law, Restitution):
            gain /= max(touch_speed, law.speed_floor)
        return spring * (1.0 + gain * rate), 1.0 + gain * rate

    @staticmethod
    def _adams_push(law: AdamsImpact, depth: float, rate: float) -> float:
        """Return the force over d^min(n, 2): it keeps its sign down to d = 0, and beyond it."""
        common = min(law.exponent, 2.0)
        damping = law.damping * (3.0 - 2.0 * depth / law.damping_depth) / law.damping_depth**2
        stiffness = law.stiffness * depth ** (law.exponent - common)
        return float(stiffness + damping * depth ** (2.0 - common) * rate)

    @staticmethod
    def _adams_damping(law: AdamsImpact, depth: float, deep: bool) -> float:
        """Return ADAMS' STEP(d, 0, 0, depth, cmax) [N s/m]."""
        if deep:
            return law.damping
        share = depth / law.damping_depth
        return law.damping * share**2 * (3.0 - 2.0 * share)
