"""What a robot takes for the forces on its feet."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

from pydantic import PositiveFloat, model_serializer

from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from pydantic import SerializerFunctionWrapHandler


class FootForceSensing(Spec):
    """Where foot forces come from, and when a foot counts as touching.

    "foot": sensors in the feet. "torque": from the joints' torques, J^-T (tau_leg - tau), with
    tau_leg what the leg's own weight and motion need (Newton-Euler; joint accelerations from two
    ticks) and tau the motors' torques less what friction takes from them. "current": the same from
    the motors' torques as they are, friction unknown. Noise, delay and rounding are those of
    `Sensors`.

    Attributes:
        source: of the forces.
        cutoff: of a first-order low-pass filter on them [Hz]; None: no filter.
        threshold: a foot with more force than this touches, one with less than a quarter is free
            [N]; None: 4, 12 or 20 % of the robot's weight for the three sources (*assumed*).
    """

    kind: Literal["foot-force-sensing"] = "foot-force-sensing"
    source: Literal["foot", "torque", "current"] = "foot"
    cutoff: PositiveFloat | None = None
    threshold: PositiveFloat | None = None

    @property
    def filter_time(self) -> float:
        """Time constant of the filter [s]."""
        return 0.0 if self.cutoff is None else 1.0 / (2.0 * math.pi * self.cutoff)

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {name: value for name, value in dump(self).items() if value is not None}
