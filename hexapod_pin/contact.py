"""Contact laws of a spherical foot on the ground: normal force and friction.

Each law is frozen data; its formula lives once, in the native core (`native/normal.hpp`,
`native/friction.hpp`), and `force` evaluates it from Python. Depth d and approach rate d' are
positive into the ground.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from hexapod_pin.errors import UnknownNameError
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

MM_PER_M = 1e3
Exponent = Annotated[float, Field(ge=1.0)]


def stiffness_from_mm(stiffness: float, exponent: float) -> float:
    """Convert a contact stiffness from N/mm^n to N/m^n (factor 1000^n)."""
    return stiffness * float(MM_PER_M**exponent)


def hertz_stiffness(*, young: float, poisson: float, radius: float) -> float:
    """Return Hertz' K [N/m^1.5] of an elastic sphere on rigid ground.

    K = 4/3 E* sqrt(R), E* = E / (1 - nu^2) (Johnson 1985; valid while the contact radius
    sqrt(R d) is much smaller than R).

    Args:
        young: Young's modulus E of the sphere [Pa].
        poisson: Poisson's ratio nu [-].
        radius: R [m].
    """
    return 4.0 / 3.0 * young / (1.0 - poisson**2) * math.sqrt(radius)


class NormalLaw(Spec):
    """Base of the normal laws."""

    def native(self) -> Any:
        """Return the native law."""
        raise TypeError(f"{type(self).__name__} is abstract")

    def force(self, depth: ArrayLike, rate: ArrayLike = 0.0) -> Array:
        """Return the normal force [N], never negative.

        Args:
            depth: penetration d [m], any shape.
            rate: d' [m/s], broadcast against `depth`.
        """
        import numpy as np

        law = self.native()
        return np.asarray(np.vectorize(lambda d, r: law(d, r)[0], otypes=[float])(depth, rate))


class HuntCrossley(NormalLaw):
    """F = K d^n max(0, 1 + 1.5 a d') (Hunt & Crossley 1975; S1 eq. 4 with the exponent restored).

    Attributes:
        stiffness: K [N/m^n].
        exponent: n [-]; 1.5 is Hertz' sphere on a plane, 1 is S1 eq. 4 as printed.
        dissipation: a [s/m]; 0 is elastic.
    """

    kind: Literal["hunt-crossley"] = "hunt-crossley"
    stiffness: PositiveFloat
    exponent: Exponent = 1.5
    dissipation: NonNegativeFloat = 0.0

    def native(self) -> Any:
        """Return the native law."""
        from hexapod_pin import native as _native

        law = _native.NormalLaw()
        law.kind = _native.NormalKind.hunt_crossley
        law.stiffness, law.exponent = self.stiffness, self.exponent
        law.dissipation = self.dissipation
        return law


class AdamsImpact(NormalLaw):
    """ADAMS IMPACT (S2): F = max(0, K d^n + c(d) d'), c = cmax s^2 (3 - 2 s), s = min(d/depth, 1).

    Attributes:
        stiffness: K [N/m^n].
        exponent: n [-].
        damping: cmax [N s/m].
        damping_depth: penetration of full damping [m].
    """

    kind: Literal["adams-impact"] = "adams-impact"
    stiffness: PositiveFloat
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

    def native(self) -> Any:
        """Return the native law."""
        from hexapod_pin import native as _native

        law = _native.NormalLaw()
        law.kind = _native.NormalKind.adams_impact
        law.stiffness, law.exponent = self.stiffness, self.exponent
        law.damping, law.damping_depth = self.damping, self.damping_depth
        return law


class FrictionLaw(Spec):
    """Base of the friction laws: f_t = -N m(s) u_t/s, slip speed s = |u_t|."""

    def native(self) -> Any:
        """Return the native law."""
        raise TypeError(f"{type(self).__name__} is abstract")

    def coefficient(self, speed: ArrayLike) -> Array:
        """Return m(s) [-], the friction force over the normal force, at slip speed [m/s]."""
        import numpy as np

        law = self.native()
        return np.asarray(np.vectorize(lambda s: law(s)[0] * s, otypes=[float])(speed))


class TanhCoulomb(FrictionLaw):
    """m(s) = mu tanh(kt s) (S1 eq. 5). It creeps at atanh(load/(mu N))/kt under a load.

    Attributes:
        mu: coefficient of friction [-].
        slope: kt [s/m].
    """

    kind: Literal["tanh-coulomb"] = "tanh-coulomb"
    mu: NonNegativeFloat
    slope: PositiveFloat

    def native(self) -> Any:
        """Return the native law."""
        from hexapod_pin import native as _native

        law = _native.FrictionLaw()
        law.kind = _native.FrictionKind.tanh_coulomb
        law.mu, law.slip_slope = self.mu, self.slope
        return law


class AdamsCoulomb(FrictionLaw):
    """ADAMS' two-speed Coulomb friction (S2): cubic STEPs through 0, mu_static and mu_dynamic.

    Attributes:
        mu_static: coefficient at the stiction speed [-].
        mu_dynamic: coefficient above the transition speed [-].
        stiction_speed: [m/s].
        transition_speed: [m/s], above the stiction speed.
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
        from hexapod_pin import native as _native

        law = _native.FrictionLaw()
        law.kind = _native.FrictionKind.adams_coulomb
        law.mu, law.mu_dynamic = self.mu_static, self.mu_dynamic
        law.stiction_speed = self.stiction_speed
        law.transition_speed = self.transition_speed
        return law


class Contact(Spec):
    """What a foot feels: a normal law and a friction law.

    Attributes:
        normal: HuntCrossley or AdamsImpact.
        friction: TanhCoulomb or AdamsCoulomb.
        assumed: which of the numbers no source gives, in words; empty for a user's own.
    """

    normal: Annotated[HuntCrossley | AdamsImpact, Field(discriminator="kind")]
    friction: Annotated[TanhCoulomb | AdamsCoulomb, Field(discriminator="kind")]
    assumed: str = ""

    @classmethod
    def s1(cls) -> Contact:
        """S1's laws. S1 prints no numbers: a rubber foot is *assumed*.

        E = 5 MPa, nu = 0.49, R = 20 mm; dissipation 20 s/m gives a restitution of 0.3 at 0.1 m/s.
        """
        return cls(
            normal=HuntCrossley(
                stiffness=hertz_stiffness(young=5e6, poisson=0.49, radius=0.020), dissipation=20.0
            ),
            friction=TanhCoulomb(mu=0.7, slope=1e3),
            assumed="S1 prints no contact numbers: rubber foot E 5 MPa, nu 0.49, R 20 mm, "
            "dissipation 20 s/m, mu 0.7, kt 1000 s/m",
        )

    @classmethod
    def s2(cls) -> Contact:
        """S2's numbers (figure 4): K 1e5 N/mm^2.2, c 10 N s/mm at 0.1 mm; mu 0.3/0.1 at 0.1/1 m/s.

        They look like untouched ADAMS defaults: a regression set, not a measured foot.
        """
        return cls(
            normal=AdamsImpact.from_mm(
                stiffness=1e5, exponent=2.2, damping=10.0, damping_depth=0.1
            ),
            friction=AdamsCoulomb(
                mu_static=0.3, mu_dynamic=0.1, stiction_speed=0.1, transition_speed=1.0
            ),
        )

    @classmethod
    def preset(cls, name: str) -> Contact:
        """Return the preset "s1" or "s2".

        Raises:
            UnknownNameError: for another name.
        """
        presets = {"s1": cls.s1, "s2": cls.s2}
        if name not in presets:
            raise UnknownNameError("contact preset", name, list(presets))
        return presets[name]()
