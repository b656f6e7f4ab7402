"""A free impact: a mass meets the ground once, without gravity, under a normal law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.ground.contact.normal import NormalLaw

MAX_CONTACT_TIME_RATIO = 1e5
"""Time after which a foot that has not left is said to stick, in units of depth over speed."""

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
