"""Friction that is a function of slip speed, by its sources; written apart from the native core."""

from __future__ import annotations

import math

from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact.friction import (
    AdamsCoulomb,
    BrownMcPhee,
    FrictionLaw,
    SmoothStep,
    TanhCoulomb,
)


class FrictionShare:
    """m(s): friction over normal force at slip speed s.

    Attributes:
        breaks: speeds at which a derivative of m jumps [m/s], increasing.
    """

    def __init__(self, law: FrictionLaw) -> None:
        """Read the law's parameters.

        Raises:
            ParameterError: a law that is not written here.
        """
        self._law = law
        self.breaks: tuple[float, ...] = ()
        if isinstance(law, AdamsCoulomb):
            self.breaks = (law.stiction_speed, law.transition_speed)
        elif isinstance(law, SmoothStep):
            self.breaks = (law.speed, 3.0 * law.speed)
        elif not isinstance(law, TanhCoulomb | BrownMcPhee):
            raise ParameterError("Contact.friction", type(law).__name__, "a law of slip speed")

    def __call__(self, speed: float, piece: int) -> float:
        """Return m(s) [-] on a piece between the breaks, beyond the piece's ends too."""
        law = self._law
        if isinstance(law, TanhCoulomb):
            return law.mu * math.tanh(law.slope * speed)
        if isinstance(law, BrownMcPhee):
            x = speed / law.speed
            peak = (law.mu_static - law.mu_dynamic) * x / (x**2 / 4.0 + 3.0 / 4.0) ** 2
            return law.mu_dynamic * math.tanh(4.0 * x) + peak
        if isinstance(law, AdamsCoulomb):
            return self._adams(law, speed, piece)
        assert isinstance(law, SmoothStep)
        if piece == 0:
            return law.mu_static * _step5(speed / law.speed)
        fall = _step5((speed / law.speed - 1.0) / 2.0) if piece == 1 else 1.0
        return law.mu_static + (law.mu_dynamic - law.mu_static) * fall

    @staticmethod
    def _adams(law: AdamsCoulomb, s: float, piece: int) -> float:
        vs, vd = law.stiction_speed, law.transition_speed
        if piece == 0:
            return _step(s, -vs, -law.mu_static, vs, law.mu_static)
        return _step(s, vs, law.mu_static, vd, law.mu_dynamic) if piece == 1 else law.mu_dynamic


def _step(x: float, x0: float, h0: float, x1: float, h1: float) -> float:
    """Return ADAMS' cubic STEP, not clamped."""
    share = (x - x0) / (x1 - x0)
    return h0 + (h1 - h0) * share**2 * (3.0 - 2.0 * share)


def _step5(x: float) -> float:
    """Return the quintic step x^3 (10 - 15 x + 6 x^2), not clamped."""
    return x**3 * (10.0 + x * (6.0 * x - 15.0))
