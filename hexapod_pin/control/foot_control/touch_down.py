"""Touch-down by what a foot feels, and a trunk that follows the ground under its feet."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from hexapod_pin.spec import Spec


class TouchDown(Spec):
    """Feet that stop where they meet the ground, search for it, and rise over what stops them.

    All defaults are *assumed*.

    Attributes:
        earliest: share of the swing before which no ground is expected [-].
        search_speed: of a foot that goes on down [m/s].
        search_depth: how far below the plan it goes; there it waits [m].
        rise_speed: of a swinging foot that runs against something [m/s].
        rise_limit: how far above the plan it rises [m].
        retreat_speed: of such a foot, back from what it met [m/s].
        patience: longest time that the walk waits for a foot that finds no ground; 0: none [s].
        lost_after: time without load after which a standing foot searches [s].
        height_time: in which the trunk's height follows the mean of the standing feet [s].
        tilt_time: in which the trunk's tilt follows the plane of the standing feet [s].
    """

    kind: Literal["touch-down"] = "touch-down"
    earliest: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    search_speed: PositiveFloat = 0.1
    search_depth: NonNegativeFloat = 0.03
    rise_speed: PositiveFloat = 0.2
    rise_limit: NonNegativeFloat = 0.04
    retreat_speed: NonNegativeFloat = 0.05
    patience: NonNegativeFloat = 0.3
    lost_after: PositiveFloat = 0.3
    height_time: PositiveFloat = 0.5
    tilt_time: PositiveFloat = 1.5
