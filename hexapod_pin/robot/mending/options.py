"""What a user says of a robot whose file does not."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hexapod_pin.spec import Spec


class MendOptions(Spec):
    """Numbers that go before assumed ones; None leaves them to be assumed.

    Attributes:
        mass: total mass [kg], 1e-6 to 1e6. Links without a mass share what the others leave; where
            all have one, masses and inertias are scaled.
        density: mass over volume of the convex hull of links without a mass [kg/m^3], 1e-3 to 1e5.
        effort: torque limit of every revolute joint [N m], 1e-9 to 1e6.
        velocity: speed limit of every revolute joint [rad/s], 1e-9 to 1e4.
    """

    mass: Annotated[float, Field(ge=1e-6, le=1e6)] | None = None
    density: Annotated[float, Field(ge=1e-3, le=1e5)] | None = None
    effort: Annotated[float, Field(ge=1e-9, le=1e6)] | None = None
    velocity: Annotated[float, Field(ge=1e-9, le=1e4)] | None = None
