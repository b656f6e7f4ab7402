"""The contact laws written again from their sources, in NumPy, for complex arguments too.

Clamps and branches look at real parts, so that an imaginary step gives an exact derivative.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import hexapod_pin as hp

NORMAL = {
    "hertz": hp.contact.HuntCrossley(stiffness=1.24e6, dissipation=20.0),
    "printed": hp.contact.HuntCrossley(stiffness=1e4, exponent=1.0, dissipation=0.5),
    "kelvin-voigt": hp.contact.KelvinVoigt(stiffness=2.75e4, damping=40.0),
    "kelvin-voigt 1.5": hp.contact.KelvinVoigt(stiffness=1.24e6, exponent=1.5, damping=5.0),
    "restitution": hp.contact.Restitution(stiffness=1.24e6, restitution=0.3),
    "flores 2.2": hp.contact.Restitution(
        stiffness=1e9, exponent=2.2, restitution=0.6, model="flores"
    ),
    "adams": hp.Contact.s2().normal,
}
FRICTION = {
    "tanh": hp.contact.TanhCoulomb(mu=0.7, slope=1e3),
    "adams": hp.Contact.s2().friction,
    "smooth-step": hp.contact.SmoothStep(mu_static=0.7, mu_dynamic=0.5, speed=0.02),
    "brown-mcphee": hp.contact.BrownMcPhee(mu_static=0.7, mu_dynamic=0.4, speed=0.02),
}


def cubic_step(x: Any, x0: float, h0: float, x1: float, h1: float) -> Any:
    """ADAMS' STEP, as its manual prints it."""
    d = (x - x0) / (x1 - x0)
    if d.real <= 0.0:
        return h0
    return h1 if d.real >= 1.0 else h0 + (h1 - h0) * d * d * (3.0 - 2.0 * d)


def quintic_step(x: Any) -> Any:
    """Drake's step5: 10 x^3 - 15 x^4 + 6 x^5."""
    return 10.0 * x**3 - 15.0 * x**4 + 6.0 * x**5


def numpy_normal(law: Any, depth: Any, rate: Any, touch_speed: float = 0.0) -> Any:
    """Normal force of a law [N]; 0 without penetration, and where the formula would pull."""
    if np.real(depth) <= 0.0:
        return 0.0
    spring = law.stiffness * depth**law.exponent
    if isinstance(law, hp.contact.HuntCrossley):
        force = spring * (1.0 + 1.5 * law.dissipation * rate)
    elif isinstance(law, hp.contact.Restitution):
        force = spring * (1.0 + law.eta * rate / max(touch_speed, law.speed_floor))
    elif isinstance(law, hp.contact.KelvinVoigt):
        force = spring + law.damping * rate
    else:
        force = spring + cubic_step(depth, 0.0, 0.0, law.damping_depth, law.damping) * rate
    return force if np.real(force) > 0.0 else 0.0


def numpy_friction(law: Any, speed: Any) -> Any:
    """m(s) of a law [-]."""
    if isinstance(law, hp.contact.TanhCoulomb):
        return law.mu * np.tanh(law.slope * speed)
    if isinstance(law, hp.contact.AdamsCoulomb):
        vs, vd = law.stiction_speed, law.transition_speed
        if np.real(speed) < vs:
            return cubic_step(speed, -vs, -law.mu_static, vs, law.mu_static)
        return cubic_step(speed, vs, law.mu_static, vd, law.mu_dynamic)
    x, drop = speed / law.speed, law.mu_static - law.mu_dynamic
    if isinstance(law, hp.contact.BrownMcPhee):
        return law.mu_dynamic * np.tanh(4.0 * x) + drop * x / (0.25 * x**2 + 0.75) ** 2
    if np.real(x) < 1.0:
        return law.mu_static * quintic_step(x)
    return law.mu_static - drop * quintic_step((x - 1.0) / 2.0) if x.real < 3.0 else law.mu_dynamic
