"""The ground the feet stand on."""

from __future__ import annotations

from typing import Literal

from hexapod_pin.spec import Spec


class Flat(Spec):
    """A horizontal plane.

    Attributes:
        height: z of the plane in the world [m].
    """

    kind: Literal["flat"] = "flat"
    height: float = 0.0
