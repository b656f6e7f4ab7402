"""Changes of a robot's own masses: links scaled, and mass taken away."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from pydantic import PositiveFloat, field_validator

from hexapod_pin.simulation.payload import Name, Payload, Triple
from hexapod_pin.spec import Spec


class MassFactor(Spec):
    """Mass and inertia of links times a factor: a robot heavier or lighter than its file says.

    Attributes:
        factor: on mass and inertia [-]; centres of mass stay.
        links: names of links; each stands for all that is rigidly fixed to it. Empty: all links.
    """

    kind: Literal["mass-factor"] = "mass-factor"
    factor: PositiveFloat
    links: tuple[Name, ...] = ()

    def __init__(self, factor: float, links: Sequence[str] = (), **others: Any) -> None:
        """Check the numbers.

        Raises:
            ParameterError: naming the field, the value and what is allowed.
        """
        super().__init__(factor=factor, links=links, **others)

    @field_validator("links", mode="before")
    @classmethod
    def _plain(cls, value: Any) -> Any:
        return tuple(value) if isinstance(value, list) else value


class RemovedMass(Spec):
    """A point mass taken away from a link that contains it, such as a motor to be replaced.

    Attributes:
        link: name of a link, also one that is fixed to another.
        mass: what is taken away [kg].
        position: where it was, in the link's frame [m].
    """

    kind: Literal["removed-mass"] = "removed-mass"
    link: Name
    mass: PositiveFloat
    position: Triple = (0.0, 0.0, 0.0)

    def __init__(
        self, link: str, mass: float, position: Sequence[float] = (0.0, 0.0, 0.0), **others: Any
    ) -> None:
        """Check the numbers.

        Raises:
            ParameterError: naming the field, the value and what is allowed.
        """
        super().__init__(link=link, mass=mass, position=position, **others)

    @field_validator("position", mode="before")
    @classmethod
    def _plain(cls, value: Any) -> Any:
        return value.tolist() if isinstance(value, np.ndarray) else value


MassLoad = Payload | MassFactor | RemovedMass


def links_of(load: MassLoad) -> tuple[str, ...]:
    """Return the links that a load names."""
    return load.links if isinstance(load, MassFactor) else (load.link,)
