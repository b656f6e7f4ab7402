"""What a user says of a robot whose file does not."""

from __future__ import annotations

from pydantic import PositiveFloat

from hexapod_pin.spec import Spec


class MendOptions(Spec):
    """Numbers that go before assumed ones; None leaves them to be assumed.

    Attributes:
        mass: total mass [kg]. Links without a mass share what the others leave; where all have
            one, masses and inertias are scaled.
        density: mass over volume of the convex hull of links without a mass [kg/m^3].
        effort: torque limit of every revolute joint [N m].
        velocity: speed limit of every revolute joint [rad/s].
    """

    mass: PositiveFloat | None = None
    density: PositiveFloat | None = None
    effort: PositiveFloat | None = None
    velocity: PositiveFloat | None = None
