"""Levelling: the legs put a trunk level that stands on a slope."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, PositiveFloat

from hexapod_pin.spec import Spec


class Levelling(Spec):
    """Integral control of roll and pitch as the trunk's orientation sensor has them.

    Attributes:
        bandwidth: of the loop [Hz]. The default is *assumed*.
        limit: largest tilt of the feet's plane against the trunk; a steeper slope leaves the rest
            [rad]. The default is *assumed*: legs must reach, and a level trunk comes near a slope.
    """

    kind: Literal["levelling"] = "levelling"
    bandwidth: PositiveFloat = 0.3
    limit: Annotated[float, Field(gt=0.0, le=math.pi / 4)] = 0.06

    @property
    def rate(self) -> float:
        """Of the integral [1/s]."""
        return 2.0 * math.pi * self.bandwidth
