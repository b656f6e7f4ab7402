"""Baumgarte's stabilisation of S1 eq. 1: gamma becomes gamma - 2 alpha Phi' - beta^2 Phi."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pydantic import NonNegativeFloat

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array


class Baumgarte(Spec):
    """What closes drifted joints again: Phi'' + 2 alpha Phi' + beta^2 Phi = 0 (S1).

    With alpha = beta both roots lie at -alpha: an explicit step h is stable for h alpha < 2 (Euler)
    or 2.78 (RK4). Methods with inner stages lose order to large terms: see docs/formulations.md.

    Attributes:
        alpha: [1/s].
        beta: [1/s].
    """

    alpha: NonNegativeFloat = 0.0
    beta: NonNegativeFloat = 0.0

    @classmethod
    def off(cls) -> Baumgarte:
        """No terms: position errors grow with t^2."""
        return cls()

    @classmethod
    def constant(cls) -> Baumgarte:
        """The usual constant, alpha = beta = 5 1/s, critically damped (Nikravesh; Flores)."""
        return cls(alpha=5.0, beta=5.0)

    @classmethod
    def critical(cls, rate: float) -> Baumgarte:
        """Any critically damped pair, alpha = beta = rate [1/s]."""
        return cls(alpha=rate, beta=rate)

    @classmethod
    def by_step(cls, step: float) -> Baumgarte:
        """From the step h [s]: alpha = 1/h, beta = sqrt(2)/h (Flores et al. 2011).

        The pair that cancels Phi at t + h in a second-order Taylor series. For methods that
        evaluate once a step: RK4's stages turn it into an error of order 2.

        Raises:
            ParameterError: the step is not positive and finite.
        """
        if not (math.isfinite(step) and step > 0.0):
            raise ParameterError("step", step, "positive and finite [s]")
        return cls(alpha=1.0 / step, beta=math.sqrt(2.0) / step)

    def right_side(self, gamma: Array, rate: Array, violation: Array) -> Array:
        """Return gamma - 2 alpha Phi' - beta^2 Phi, the right side of D v' in S1 eq. 1."""
        return gamma - 2.0 * self.alpha * rate - self.beta**2 * violation
