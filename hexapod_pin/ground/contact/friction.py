"""A friction law gives the tangential force of a contact.

The regularised laws are smooth functions of the slip speed and creep under load; one law holds at
rest.

A law is frozen data; its formula lives once, in the native core (`native/laws/friction.hpp`).
A law that is a function of speed alone gives no force at rest: a loaded foot creeps at the speed
where m(s) equals the load. `creep_speed` gives that speed exactly, for any law.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec, require_factor
from hexapod_pin.type_checks import Unbounded

if TYPE_CHECKING:
    from typing import Self

    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array


class FrictionLaw(Spec):
    """Base of the friction laws."""

    def native(self) -> Any:
        """Return the native law."""
        raise TypeError(f"{type(self).__name__} is abstract")

    def with_mu(self, mu: float) -> Self:
        """Return the same law with another (static) coefficient; the dynamic one keeps its ratio.

        Raises:
            ParameterError: mu is negative or not finite.
        """
        numbers = dict(self)
        static = "mu" if "mu" in numbers else "mu_static"
        if "mu_dynamic" in numbers:
            old, dynamic = numbers[static], numbers["mu_dynamic"]
            numbers["mu_dynamic"] = mu * (dynamic / old) if old > 0.0 else mu
        return type(self)(**{**numbers, static: mu})

    def stiffer(self, factor: float) -> Self:
        """Return the law of a foot `factor` times as stiff: a law without a spring as it is.

        Raises:
            ParameterError: the factor is not positive and finite.
        """
        require_factor(factor)
        return self

    @property
    def limit(self) -> float:
        """Largest m(s) [-]: a load above this share of N slides away."""
        raise TypeError(f"{type(self).__name__} is abstract")

    @property
    def jumps(self) -> bool:
        """Whether its force jumps where a foot breaks away, or comes to rest."""
        return False

    def coefficient(self, speed: ArrayLike) -> Array:
        """Return m(s) [-], the friction force over the normal force, at steady slip [m/s]."""
        import numpy as np

        law = self.native()
        return np.asarray(np.vectorize(lambda s: law(s)[0] * s, otypes=[float])(speed))

    def creep_speed(self, load_ratio: Unbounded) -> float:
        """Return the steady slip speed [m/s] under a tangential load; inf above the limit.

        On a slope the load ratio is tan(angle).

        Args:
            load_ratio: tangential load over the normal force [-], >= 0.

        Raises:
            ParameterError: the ratio is negative or not a number.
        """
        if not load_ratio >= 0.0:
            raise ParameterError("load_ratio", load_ratio, "not negative [-]")
        if load_ratio > self.limit:
            return math.inf
        return self._creep(load_ratio) if load_ratio > 0.0 else 0.0

    def _creep(self, ratio: float) -> float:
        """Return the smallest s with m(s) = ratio, 0 < ratio <= limit."""
        raise TypeError(f"{type(self).__name__} is abstract")

    def _native(self, kind: str, **fields: float) -> Any:
        from hexapod_pin import native as _native

        law = _native.FrictionLaw()
        law.kind = getattr(_native.FrictionKind, kind)
        for name, value in fields.items():
            setattr(law, name, value)
        return law


def require_order(mu: float, mu_dynamic: float) -> None:
    """Refuse a dynamic coefficient above the static one."""
    if mu_dynamic > mu:
        raise ValueError(f"mu_dynamic = {mu_dynamic} at most the static coefficient {mu}")


# Friction laws that are smooth functions of the slip speed: no force at rest, creep under load.


class TanhCoulomb(FrictionLaw):
    """m(s) = mu tanh(kt s) (S1 eq. 5). Creep atanh(load/mu)/kt, without bound at the limit.

    Attributes:
        mu: coefficient of friction [-].
        slope: kt [s/m].
    """

    kind: Literal["tanh-coulomb"] = "tanh-coulomb"
    mu: NonNegativeFloat
    slope: PositiveFloat

    def native(self) -> Any:
        """Return the native law."""
        return self._native("tanh_coulomb", mu=self.mu, slip_slope=self.slope)

    @property
    def limit(self) -> float:
        """The coefficient, reached only at infinite speed."""
        return self.mu

    def _creep(self, ratio: float) -> float:
        share = ratio / self.mu
        return math.atanh(share) / self.slope if share < 1.0 else math.inf


class AdamsCoulomb(FrictionLaw):
    """ADAMS' two-speed Coulomb friction (S2): cubic STEPs through 0, mu_static and mu_dynamic.

    Creep is the root of the STEP, vs 2 sin(asin(load/mu_static)/3): with vs = 0.1 m/s and
    mu_static = 0.3 a slope of 5 degrees slides at 20 mm/s.

    Attributes:
        mu_static: coefficient at the stiction speed [-].
        mu_dynamic: coefficient above the transition speed [-].
        stiction_speed: vs [m/s].
        transition_speed: vd [m/s], above the stiction speed.
    """

    kind: Literal["adams-coulomb"] = "adams-coulomb"
    mu_static: NonNegativeFloat
    mu_dynamic: NonNegativeFloat
    stiction_speed: PositiveFloat
    transition_speed: PositiveFloat

    @model_validator(mode="after")
    def _ordered(self) -> AdamsCoulomb:
        if self.transition_speed <= self.stiction_speed:
            raise ValueError(f"transition_speed above stiction_speed = {self.stiction_speed} m/s")
        return self

    def native(self) -> Any:
        """Return the native law."""
        return self._native(
            "adams_coulomb",
            mu=self.mu_static,
            mu_dynamic=self.mu_dynamic,
            stiction_speed=self.stiction_speed,
            transition_speed=self.transition_speed,
        )

    @property
    def limit(self) -> float:
        """The larger coefficient."""
        return max(self.mu_static, self.mu_dynamic)

    def _creep(self, ratio: float) -> float:
        if ratio <= self.mu_static:  # mu x (3 - x^2)/2 = ratio
            return self.stiction_speed * 2.0 * math.sin(math.asin(ratio / self.mu_static) / 3.0)
        rise = (ratio - self.mu_static) / (self.mu_dynamic - self.mu_static)
        share = 0.5 - math.sin(math.asin(1.0 - 2.0 * rise) / 3.0)  # D^2 (3 - 2 D) = rise
        return self.stiction_speed + share * (self.transition_speed - self.stiction_speed)


class SmoothStep(FrictionLaw):
    """Drake's Stribeck curve: quintic steps from 0 to mu_static at vs, to mu_dynamic at 3 vs.

    m = mu_static S(s/vs) below vs, mu_static + (mu_dynamic - mu_static) S((s/vs - 1)/2) up to
    3 vs, S(x) = x^3 (10 - 15 x + 6 x^2). Creep is the root of the first step, near
    vs (load/(10 mu_static))^(1/3) for small loads: the curve is flat at zero, so even a small load
    creeps at a large share of vs.

    Attributes:
        mu_static: coefficient at the stiction speed [-].
        mu_dynamic: coefficient above three times the stiction speed [-], at most mu_static.
        speed: vs, the stiction speed [m/s]; 1e-3 in Drake's examples.
    """

    kind: Literal["smooth-step"] = "smooth-step"
    mu_static: NonNegativeFloat
    mu_dynamic: NonNegativeFloat
    speed: PositiveFloat

    @model_validator(mode="after")
    def _ordered(self) -> SmoothStep:
        require_order(self.mu_static, self.mu_dynamic)
        return self

    def native(self) -> Any:
        """Return the native law."""
        return self._native(
            "smooth_step",
            mu=self.mu_static,
            mu_dynamic=self.mu_dynamic,
            stiction_speed=self.speed,
        )

    @property
    def limit(self) -> float:
        """The static coefficient."""
        return self.mu_static

    def _creep(self, ratio: float) -> float:
        law = self.native()
        return _first_above(lambda s: bool(law(s)[0] * s >= ratio), self.speed)


class BrownMcPhee(FrictionLaw):
    """m = mu_d tanh(4 x) + (mu_s - mu_d) x/(x^2/4 + 3/4)^2, x = s/speed (Brown & McPhee 2016).

    Creep is the root on the rising side of the peak, near speed load/(4 mu_d + 16/9 (mu_s - mu_d))
    for small loads. The peak lies at or just beyond x = 1, a little below mu_s: see `limit`.

    Attributes:
        mu_static: mu_s, (nearly) the largest coefficient [-].
        mu_dynamic: mu_d, the coefficient at large speed [-], at most mu_static.
        speed: the transition speed, of the peak [m/s].
    """

    kind: Literal["brown-mcphee"] = "brown-mcphee"
    mu_static: NonNegativeFloat
    mu_dynamic: NonNegativeFloat
    speed: PositiveFloat

    @model_validator(mode="after")
    def _ordered(self) -> BrownMcPhee:
        require_order(self.mu_static, self.mu_dynamic)
        return self

    def native(self) -> Any:
        """Return the native law."""
        return self._native(
            "brown_mcphee",
            mu=self.mu_static,
            mu_dynamic=self.mu_dynamic,
            stiction_speed=self.speed,
        )

    @property
    def limit(self) -> float:
        """The largest m(s)."""
        law, peak = self.native(), self._peak()
        return max(float(law(peak)[0] * peak), self.mu_dynamic)

    def _peak(self) -> float:
        """Return the speed of the largest m(s) [m/s]; without a peak, where tanh has ended."""
        law = self.native()
        flat = 10.0 * self.speed  # tanh(40) is 1 to rounding

        def falls(s: float) -> bool:
            ratio, slope = law(s)
            return bool(ratio + slope * s * s <= 0.0)  # dm/ds

        return _first_above(falls, flat)

    def _creep(self, ratio: float) -> float:
        law = self.native()
        peak = self._peak()
        if ratio > law(peak)[0] * peak:
            return math.inf
        return _first_above(lambda s: bool(law(s)[0] * s >= ratio), peak)


def _first_above(above: Callable[[float], bool], high: float) -> float:
    """Return the smallest s in (0, high] where `above` holds, to neighbouring numbers."""
    low = 0.0
    while low < (middle := 0.5 * (low + high)) < high:
        if above(middle):
            high = middle
        else:
            low = middle
    return high


# Friction that holds at rest: an elastic spring that slides at the Coulomb limit.


class StickSlip(FrictionLaw):
    """An elastic bristle per foot: it sticks up to mu N, slides at mu_dynamic N, and never creeps.

    f_t = -(k z + c u_t), z the stretch since the foot stuck; beyond the cone the force is scaled
    back to mu_dynamic N and z follows (Cundall & Strack 1979; Gonthier 2004). It sticks again where
    |k z + c u_t| falls to mu_dynamic N: its slip, (|k z + c u_t| - mu_dynamic N)/c, is zero. Below
    the limit the foot moves by its load over k once, and then stands: its creep speed is exactly
    zero. The core stores z per foot.

    Attributes:
        mu: coefficient while it sticks [-].
        mu_dynamic: coefficient while it slides [-], at most mu; mu if not given.
        stiffness: k [N/m].
        damping: c [N s/m].
    """

    kind: Literal["stick-slip"] = "stick-slip"
    mu: NonNegativeFloat
    mu_dynamic: NonNegativeFloat = Field(default_factory=lambda: 0.0)  # mu takes its place
    stiffness: PositiveFloat
    damping: NonNegativeFloat

    @model_validator(mode="before")
    @classmethod
    def _one_coefficient(cls, fields: Any) -> Any:
        if isinstance(fields, dict) and fields.get("mu_dynamic") is None and "mu" in fields:
            return {**fields, "mu_dynamic": fields["mu"]}
        return fields

    @model_validator(mode="after")
    def _ordered(self) -> StickSlip:
        require_order(self.mu, self.mu_dynamic)
        return self

    def native(self) -> Any:
        """Return the native law."""
        return self._native(
            "bristle",
            mu=self.mu,
            mu_dynamic=self.mu_dynamic,
            bristle_stiffness=self.stiffness,
            bristle_damping=self.damping,
        )

    def stiffer(self, factor: float) -> Self:
        """Return the law of a foot `factor` times as stiff, with the same damping ratio.

        k goes with the normal stiffness, as both go with the material's modulus (Mindlin 1949: k
        over Hertz' stiffness is 2 (1 - nu)/(2 - nu)).

        Args:
            factor: on k [-]; c takes its square root.

        Raises:
            ParameterError: the factor is not positive and finite.
        """
        damping = math.sqrt(require_factor(factor)) * self.damping
        changed = {"stiffness": factor * self.stiffness, "damping": damping}
        return type(self)(**{**dict(self), **changed})

    @property
    def limit(self) -> float:
        """The sticking coefficient."""
        return self.mu

    @property
    def jumps(self) -> bool:
        """Whether it drops from mu N to mu_dynamic N where a foot breaks away."""
        return self.mu_dynamic < self.mu

    def coefficient(self, speed: ArrayLike) -> Array:
        """Return m(s) [-] in steady slip [m/s]: mu_dynamic, and at rest 0 (anything up to mu)."""
        import numpy as np

        return np.where(np.asarray(speed) > 0.0, self.mu_dynamic, 0.0)

    def _creep(self, ratio: float) -> float:
        return 0.0
