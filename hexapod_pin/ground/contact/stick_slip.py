"""Friction that holds at rest: an elastic spring that slides at the Coulomb limit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from hexapod_pin.ground.contact.friction_law import FrictionLaw, require_order, same_ratio
from hexapod_pin.spec import require_factor

if TYPE_CHECKING:
    from typing import Self

    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array


class StickSlip(FrictionLaw):
    """An elastic bristle per foot: it sticks up to mu N, slides at mu_dynamic N, and never creeps.

    f_t = -(k z + c u_t), z the stretch since the foot stuck; beyond the cone the force is scaled
    back to mu_dynamic N and z follows (Cundall & Strack 1979; Gonthier 2004). It sticks again where
    |k z + c u_t| falls to mu_dynamic N: its slip, (|k z + c u_t| - mu_dynamic N)/c, is zero. Below
    the limit the foot moves by its load over k once, and then stands: its creep speed is exactly
    zero. The core keeps z per foot.

    Attributes:
        mu: coefficient while it sticks [-].
        mu_dynamic: coefficient while it slides [-], at most mu; mu if not given.
        stiffness: k [N/m].
        damping: c [N s/m].
    """

    kind: Literal["stick-slip"] = "stick-slip"
    mu: NonNegativeFloat
    mu_dynamic: NonNegativeFloat = Field(default_factory=float)  # mu takes its place, see below
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

    def with_mu(self, mu: float) -> StickSlip:
        """Return the same law with another sticking coefficient."""
        return StickSlip(
            mu=mu,
            mu_dynamic=same_ratio(mu, self.mu, self.mu_dynamic),
            stiffness=self.stiffness,
            damping=self.damping,
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
        return type(self)(**{**self.model_dump(), **changed})

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
