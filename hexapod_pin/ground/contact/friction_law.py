"""What every friction law is: f_t = -N m(s) u_t/s at slip speed s = |u_t|.

A law is frozen data; its formula lives once, in the native core (`native/laws/friction.hpp`).
A law that is a function of speed alone gives no force at rest: a loaded foot creeps at the speed
where m(s) equals the load. `creep_speed` gives that speed exactly, for any law.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec, require_factor

if TYPE_CHECKING:
    from typing import Self

    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array


class FrictionLaw(Spec):
    """Base of the friction laws."""

    def native(self) -> Any:
        """Return the native law."""
        raise TypeError(f"{type(self).__name__} is abstract")

    def with_mu(self, mu: float) -> FrictionLaw:
        """Return the same law with another (static) coefficient; the dynamic one keeps its ratio.

        Raises:
            ParameterError: mu is negative or not finite.
        """
        raise TypeError(f"{type(self).__name__} is abstract")

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

    def creep_speed(self, load_ratio: float) -> float:
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


def same_ratio(mu: float, old_mu: float, old_dynamic: float) -> float:
    """Return the dynamic coefficient that keeps its ratio to a new static one [-]."""
    return mu * (old_dynamic / old_mu) if old_mu > 0.0 else mu


def require_order(mu: float, mu_dynamic: float) -> None:
    """Refuse a dynamic coefficient above the static one."""
    if mu_dynamic > mu:
        raise ValueError(f"mu_dynamic = {mu_dynamic} at most the static coefficient {mu}")
