"""A coefficient of restitution defines a family of normal laws.

A free impact shows the coefficient that a law delivers.

v0 is the approach speed at this contact's first touch. A free impact m v dv = -F dd gives

    ln[(1 + eta) / (1 - eta e)] = eta (1 + e),

whatever n, K, m and v0. The published laws are approximations of eta(e); the root is exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, PositiveFloat, model_validator

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact.normal import NormalLaw, hertz_stiffness

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array


Model = Literal[
    "hunt-crossley",
    "herbert-mcwhannell",
    "lee-wang",
    "lankarani-nikravesh",
    "gonthier",
    "zhiying-qishao",
    "flores",
    "gharib-hurmuzlu",
    "hu-guo",
    "exact",
]


@checked
def delivered_restitution(eta: float) -> float:
    """Return the restitution e that a free impact delivers.

    e = (1 + W0(-u exp(-u)))/eta, u = 1 + eta, with Lambert's W0. Near eta = 0 that form loses half
    its digits, so y = eta e is taken from the same relation, -ln(1 - y) - y = eta - ln(1 + eta), by
    Newton's method from above, which cannot overshoot.

    Args:
        eta: damping over d'/v0 [-], >= 0.

    Raises:
        ParameterError: eta is negative or not finite.
    """
    if not (math.isfinite(eta) and eta >= 0.0):
        raise ParameterError("eta", eta, "finite and not negative")
    if eta < 1e-8:
        return 1.0 - eta / 1.5  # the next term, 4/9 eta^2, is below one rounding
    lost = -_log1p_minus(eta)
    y = min(math.sqrt(2.0 * lost), -math.expm1(-1.0 - lost))
    while 0.0 < y < 1.0:
        smaller = y - (-_log1p_minus(-y) - lost) * (1.0 - y) / y
        if not 0.0 < smaller < y:
            break
        y = smaller
    return min(y / eta, 1.0)


@checked
def exact_damping_ratio(restitution: float) -> float:
    """Return the eta that delivers a restitution in (0, 1] to rounding.

    y = eta e lies in (0, 1) and there is one root: bisection down to neighbouring numbers.

    Raises:
        ParameterError: outside (0, 1]; 0 would need infinite damping.
    """
    e = restitution
    if not 0.0 < e <= 1.0:
        raise ParameterError("restitution", e, "above 0 and at most 1", _ZERO_RESTITUTION_REFUSED)
    if e == 1.0:
        return 0.0
    low, high = 0.0, 1.0
    while low < (y := 0.5 * (low + high)) < high:
        if _log1p_minus(y / e) < _log1p_minus(-y):
            low = y
        else:
            high = y
    return high / e


def _log1p_minus(x: float) -> float:
    """Return ln(1 + x) - x to rounding, also for small x.

    With r = x/(2 + x): ln(1 + x) = 2 (r + r^3/3 + r^5/5 + ...) and 2 r - x = -r x.
    """
    if abs(x) > 0.5:
        return math.log1p(x) - x
    r = x / (2.0 + x)
    square = r * r
    tail = sum(square**k / (2 * k + 3) for k in range(18))  # square <= 1/9: below one rounding
    return -r * x + 2.0 * r * square * tail


_ZERO_RESTITUTION_REFUSED = (
    "No finite damping stops a mass dead: take a small restitution, such as 0.01."
)

DAMPING_RATIO: dict[Model, Callable[[float], float]] = {
    "hunt-crossley": lambda e: 1.5 * (1.0 - e),
    "herbert-mcwhannell": lambda e: 6.0 * (1.0 - e) / ((2.0 * e - 1.0) ** 2 + 3.0),
    "lee-wang": lambda e: 0.75 * (1.0 - e),
    "lankarani-nikravesh": lambda e: 0.75 * (1.0 - e * e),
    "gonthier": lambda e: (1.0 - e * e) / e,
    "zhiying-qishao": lambda e: 0.75 * (1.0 - e * e) * math.exp(2.0 * (1.0 - e)),
    "flores": lambda e: 1.6 * (1.0 - e) / e,
    "gharib-hurmuzlu": lambda e: 1.0 / e,
    "hu-guo": lambda e: 1.5 * (1.0 - e) / e,
    "exact": exact_damping_ratio,
}
"""eta(e) of each law, e in (0, 1]."""


class Restitution(NormalLaw):
    """F = K d^n max(0, 1 + eta(e) d'/v0) (S1 eq. 4 with its c_d; the exponent is restored).

    The core stores v0, the approach speed at first touch, per foot, until separation.

    Attributes:
        stiffness: K [N/m^n].
        exponent: n [-]; 1.5 is Hertz' sphere on a plane, 1 is S1 eq. 4 as printed.
        restitution: e requested [-], above 0, at most 1.
        model: which eta(e); only "exact" delivers e, see `delivered`.
        speed_floor: least v0 [m/s]: a foot put down slower is damped as if it came at this speed,
            for v0 = 0 would damp without bound.
    """

    kind: Literal["restitution"] = "restitution"
    restitution: Annotated[float, Field(ge=0.0, le=1.0)]
    model: Model = "exact"
    speed_floor: PositiveFloat = 1e-3

    @model_validator(mode="after")
    def _bounces(self) -> Restitution:
        if not (self.restitution > 0.0 and math.isfinite(1.0 / self.restitution)):
            raise ParameterError(
                "Restitution.restitution",
                self.restitution,
                "above 0 and at most 1",
                _ZERO_RESTITUTION_REFUSED,
            )
        return self

    @classmethod
    def hertz(
        cls,
        *,
        young: float,
        poisson: float,
        radius: float,
        restitution: float,
        model: Model = "exact",
    ) -> Restitution:
        """Build from the sphere's material [Pa, -] and radius [m], and the restitution wanted."""
        stiffness = hertz_stiffness(young=young, poisson=poisson, radius=radius)
        return cls(stiffness=stiffness, restitution=restitution, model=model)

    @property
    def eta(self) -> float:
        """The damping over d'/v0 [-]."""
        return DAMPING_RATIO[self.model](self.restitution)

    @property
    def delivered(self) -> float:
        """The restitution [-] that a free impact faster than the floor delivers."""
        return delivered_restitution(self.eta)

    def native(self) -> Any:
        """Return the native law."""
        return self._native("restitution", eta=self.eta, speed_floor=self.speed_floor)


# A free impact: a mass meets the ground once, without gravity, under a normal law.

MAX_CONTACT_TIME_RATIO = 1e5
"""Time after which a foot that has not left is taken to stick, in units of depth over speed."""

LEAST, MOST = 1e-9, 1e9
"""Of mass [kg] and speed [m/s]."""


@dataclass(frozen=True)
class Bounce:
    """What happened during the contact, S samples from touch-down to separation.

    Attributes:
        time: (S,) [s], 0 at touch-down.
        depth: (S,) penetration [m].
        rate: (S,) its rate [m/s], > 0 approaching.
        force: (S,) of the ground on the mass [N].
        restitution: speed of leaving over speed of arriving [-]; 0 if it does not leave.
    """

    time: Array
    depth: Array
    rate: Array
    force: Array
    restitution: float


def bounce(law: NormalLaw, *, mass: float, speed: float) -> Bounce:
    """Integrate m d'' = -F(d, d', speed) from d = 0, d' = speed until separation.

    In units of the elastic depth ((n + 1) m v^2/(2 K))^(1/(n + 1)) and of the speed, by LSODA.

    Args:
        law: the normal law.
        mass: [kg].
        speed: of approach [m/s].

    Raises:
        ParameterError: mass or speed is not within LEAST and MOST.
    """
    import numpy as np
    from scipy.integrate import solve_ivp

    for name, value in (("mass", mass), ("speed", speed)):
        if not LEAST <= value <= MOST:
            raise ParameterError(name, value, f"{LEAST:g} to {MOST:g} (SI)")
    power = law.exponent + 1.0
    depth = (power * mass * speed**2 / (2.0 * law.stiffness)) ** (1.0 / power)
    native, scale = law.native(), depth / (mass * speed**2)

    def motion(_time: float, y: Array) -> tuple[float, float]:
        return y[1], -scale * native(depth * y[0], speed * y[1], speed)[0]

    def left(_time: float, y: Array) -> float:
        return float(y[0])

    left.terminal, left.direction = True, -1.0  # type: ignore[attr-defined]
    run = solve_ivp(
        motion,
        (0.0, MAX_CONTACT_TIME_RATIO),
        (0.0, 1.0),
        method="LSODA",
        rtol=1e-10,
        atol=1e-13,
        events=left,
    )
    x, u = run.y
    force = law.force(np.maximum(x, 0.0) * depth, u * speed, speed)
    restitution = -float(u[-1]) if run.status == 1 else 0.0
    return Bounce(run.t * depth / speed, x * depth, u * speed, force, restitution)
