"""Normal laws: the force of the ground on a foot from penetration and approach rate.

Each law is frozen data; its formula lives once, in the native core (`native/laws/normal.hpp`), and
`force` evaluates it from Python. Depth d and approach rate d' are positive into the ground.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact.soil import Soil
from hexapod_pin.spec import Spec, require_factor

if TYPE_CHECKING:
    from typing import Self

    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array

MM_PER_M = 1e3
Exponent = Annotated[float, Field(ge=1.0)]


@checked
def stiffness_from_mm(stiffness: float, exponent: float) -> float:
    """Convert a contact stiffness from N/mm^n to N/m^n (factor 1000^n)."""
    return stiffness * float(MM_PER_M**exponent)


@checked
def hertz_stiffness(*, young: float, poisson: float, radius: float) -> float:
    """Return Hertz' K [N/m^1.5] of an elastic sphere on rigid ground.

    K = 4/3 E* sqrt(R), E* = E / (1 - nu^2) (Johnson 1985; valid while the contact radius
    sqrt(R d) is much smaller than R).

    Args:
        young: Young's modulus E of the sphere [Pa].
        poisson: Poisson's ratio nu [-].
        radius: R [m].

    Raises:
        ParameterError: E or R is not positive, or nu is outside -1..0.5.
    """
    for name, value in (("young", young), ("radius", radius)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(name, value, "positive and finite (SI)")
    if not -1.0 < poisson <= 0.5:
        raise ParameterError("poisson", poisson, "above -1 and at most 0.5")
    return 4.0 / 3.0 * young / (1.0 - poisson**2) * math.sqrt(radius)


class NormalLaw(Spec):
    """Base of the normal laws.

    Attributes:
        stiffness: K [N/m^n] of the elastic part K d^n.
        exponent: n [-].
    """

    stiffness: PositiveFloat
    exponent: Exponent = 1.5

    def native(self) -> Any:
        """Return the native law."""
        raise TypeError(f"{type(self).__name__} is abstract")

    def _native(self, kind: str, **fields: float) -> Any:
        """Return a native law of a kind, with the elastic part and `fields` filled in."""
        from hexapod_pin import native as _native

        law = _native.NormalLaw()
        law.kind = getattr(_native.NormalKind, kind)
        law.stiffness, law.exponent = self.stiffness, self.exponent
        for name, value in fields.items():
            setattr(law, name, value)
        return law

    def stiffer(self, factor: float) -> Self:
        """Return the law of a foot `factor` times as stiff that bounces as before.

        A free impact m d'' = -F at a given speed has depths in proportion to
        L = (m v^2/K)^(1/(n + 1)): its restitution stays where damping in N s/m goes with 1/L and
        depths with L. Damping that is a share of K d^n, as here, goes with K by itself.

        Args:
            factor: on K [-].

        Raises:
            ParameterError: the factor is not positive and finite.
        """
        return self._changed(stiffness=require_factor(factor) * self.stiffness)

    def _changed(self, **fields: float) -> Self:
        """Return the same law with other numbers."""
        return type(self)(**{**dict(self), **fields})

    def _impact_depth(self, factor: float) -> float:
        """Return the depth of a free impact with `factor` times the stiffness, over that with K."""
        return float(require_factor(factor) ** (-1.0 / (self.exponent + 1.0)))

    def force(self, depth: ArrayLike, rate: ArrayLike = 0.0, touch_speed: ArrayLike = 0.0) -> Array:
        """Return the normal force [N], never negative.

        Args:
            depth: penetration d [m], any shape.
            rate: d' [m/s], broadcast against `depth`.
            touch_speed: approach speed at first touch [m/s]; only `Restitution` looks at it.
        """
        import numpy as np

        law = self.native()
        values = np.vectorize(lambda *state: law(*state)[0], otypes=[float])
        return np.asarray(values(depth, rate, touch_speed))


class HuntCrossley(NormalLaw):
    """F = K d^n max(0, 1 + 1.5 a d') (Hunt & Crossley 1975; S1 eq. 4 with the exponent restored).

    Attributes:
        stiffness: K [N/m^n].
        exponent: n [-]; 1.5 is Hertz' sphere on a plane, 1 is S1 eq. 4 as printed.
        dissipation: a [s/m]; 0 is elastic. Restitution falls with speed, about 1 - a v.
    """

    kind: Literal["hunt-crossley"] = "hunt-crossley"
    dissipation: NonNegativeFloat = 0.0

    @classmethod
    def hertz(
        cls, *, young: float, poisson: float, radius: float, dissipation: float = 0.0
    ) -> HuntCrossley:
        """Build from the sphere's material [Pa, -] and radius [m], and a dissipation [s/m]."""
        stiffness = hertz_stiffness(young=young, poisson=poisson, radius=radius)
        return cls(stiffness=stiffness, dissipation=dissipation)

    @classmethod
    def soil(
        cls, soil: Soil, *, radius: float, load: float | None = None, dissipation: float = 100.0
    ) -> HuntCrossley:
        """Build what a sphere feels on soil: Bekker's force as K d^n, and next to no rebound.

        Soil does not spring back; here it comes back slowly, with a force that is next to nothing
        while the foot leaves faster than 1/(1.5 a), 7 mm/s.

        Args:
            soil: its pressure-sinkage relation.
            radius: of the sphere [m].
            load: at which force and slope are those of the soil [N]; None: the limit of small
                depths, for a soil without cohesive modulus.
            dissipation: a [s/m]. The default is *assumed*: restitution 0.07 at 0.1 m/s.

        Raises:
            ParameterError: see `Soil.power_law`.
        """
        stiffness, exponent = soil.power_law(radius, load)
        return cls(stiffness=stiffness, exponent=exponent, dissipation=dissipation)

    def native(self) -> Any:
        """Return the native law."""
        return self._native("hunt_crossley", dissipation=self.dissipation)


class KelvinVoigt(NormalLaw):
    """F = max(0, K d^n + c d'): a spring beside a damper, without pull. A baseline.

    The force jumps to c d' at touch-down. With n = 1 on a free mass m, c = 2 zeta sqrt(K m).

    Attributes:
        stiffness: K [N/m^n].
        damping: c [N s/m].
        exponent: n [-].
    """

    kind: Literal["kelvin-voigt"] = "kelvin-voigt"
    exponent: Exponent = 1.0
    damping: NonNegativeFloat

    def stiffer(self, factor: float) -> Self:
        """Return the law of a foot `factor` times as stiff; see `NormalLaw.stiffer`."""
        damping = self.damping / self._impact_depth(factor)
        return self._changed(stiffness=factor * self.stiffness, damping=damping)

    def native(self) -> Any:
        """Return the native law."""
        return self._native("kelvin_voigt", damping=self.damping)


class AdamsImpact(NormalLaw):
    """ADAMS IMPACT (S2): F = max(0, K d^n + c(d) d'), c = cmax s^2 (3 - 2 s), s = min(d/depth, 1).

    Attributes:
        stiffness: K [N/m^n].
        exponent: n [-].
        damping: cmax [N s/m].
        damping_depth: penetration of full damping [m].
    """

    kind: Literal["adams-impact"] = "adams-impact"
    exponent: Exponent
    damping: NonNegativeFloat
    damping_depth: PositiveFloat

    @classmethod
    def from_mm(
        cls, *, stiffness: float, exponent: float, damping: float, damping_depth: float
    ) -> AdamsImpact:
        """Build from ADAMS' units: N/mm^n, -, N s/mm, mm."""
        return cls(
            stiffness=stiffness_from_mm(stiffness, exponent),
            exponent=exponent,
            damping=damping * MM_PER_M,
            damping_depth=damping_depth / MM_PER_M,
        )

    def stiffer(self, factor: float) -> Self:
        """Return the law of a foot `factor` times as stiff; see `NormalLaw.stiffer`."""
        depth = self._impact_depth(factor)
        return self._changed(
            stiffness=factor * self.stiffness,
            damping=self.damping / depth,
            damping_depth=self.damping_depth * depth,
        )

    def native(self) -> Any:
        """Return the native law."""
        return self._native("adams_impact", damping=self.damping, damping_depth=self.damping_depth)
