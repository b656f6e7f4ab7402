"""Friction laws that are smooth functions of the slip speed: no force at rest, creep under load."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

from pydantic import NonNegativeFloat, PositiveFloat, model_validator

from hexapod_pin.ground.contact.friction_law import FrictionLaw, require_order, same_ratio


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

    def with_mu(self, mu: float) -> TanhCoulomb:
        """Return the same law with another coefficient."""
        return TanhCoulomb(mu=mu, slope=self.slope)

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

    def with_mu(self, mu: float) -> AdamsCoulomb:
        """Return the same law with another static coefficient."""
        return AdamsCoulomb(
            mu_static=mu,
            mu_dynamic=same_ratio(mu, self.mu_static, self.mu_dynamic),
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

    def with_mu(self, mu: float) -> SmoothStep:
        """Return the same law with another static coefficient."""
        dynamic = same_ratio(mu, self.mu_static, self.mu_dynamic)
        return SmoothStep(mu_static=mu, mu_dynamic=dynamic, speed=self.speed)

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

    def with_mu(self, mu: float) -> BrownMcPhee:
        """Return the same law with another static coefficient."""
        dynamic = same_ratio(mu, self.mu_static, self.mu_dynamic)
        return BrownMcPhee(mu_static=mu, mu_dynamic=dynamic, speed=self.speed)

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
