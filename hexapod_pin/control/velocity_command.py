"""Speed and turn rate that change while walking, as data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import FiniteFloat

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from hexapod_pin.control.gait import Gait

COLUMNS = ("forward", "lateral", "turn_rate")


class VelocityCommand(Spec):
    """Steps of the wanted velocity of the body, each held until the next; the last one stays.

    The body follows smoothly: see `CommandedBody`. Before the first step it stands.

    Attributes:
        time: when each step begins, strictly increasing, from 0 or later [s]. S of them.
        forward: speed ahead [m/s]; S of them, or one for all.
        lateral: speed to the left [m/s]; S of them, or one for all.
        turn_rate: yaw rate, positive to the left [rad/s]; S of them, or one for all.

    Raises:
        ParameterError: no step, times not increasing from 0 on, or an unequal number of values.
    """

    kind: Literal["steps"] = "steps"
    time: tuple[FiniteFloat, ...]
    forward: FiniteFloat | tuple[FiniteFloat, ...] = 0.0
    lateral: FiniteFloat | tuple[FiniteFloat, ...] = 0.0
    turn_rate: FiniteFloat | tuple[FiniteFloat, ...] = 0.0

    def __init__(self, /, **fields: Any) -> None:
        """Check the steps."""
        super().__init__(**fields)
        if not self.time or self.time[0] < 0.0 or not (np.diff(self.time) > 0.0).all():
            raise ParameterError(
                "VelocityCommand.time", self.time, "one or more, strictly increasing from 0 s on"
            )
        for name in COLUMNS:
            values = getattr(self, name)
            if isinstance(values, tuple) and len(values) != len(self.time):
                raise ParameterError(
                    f"VelocityCommand.{name}", values, f"one number or {len(self.time)}, as of time"
                )

    @property
    def twists(self) -> Array:
        """Forward and lateral speed [m/s] and turn rate [rad/s] of each step. Shape (S, 3)."""
        columns = [np.broadcast_to(getattr(self, name), len(self.time)) for name in COLUMNS]
        return np.stack(columns, axis=-1).astype(float)

    def gaits(self, gait: Gait) -> Iterator[tuple[float, Gait]]:
        """Yield when each step begins [s], and the gait that walks at its speed for ever.

        The stroke is speed * duty * cycle time.
        """
        for time, (forward, lateral, turn_rate) in zip(
            self.time, self.twists.tolist(), strict=True
        ):
            speed = float(np.hypot(forward, lateral))
            asked = {
                "stroke": speed * gait.duty * gait.cycle_time,
                "heading": float(np.arctan2(lateral, forward)) if speed else 0.0,
                "turn_rate": turn_rate,
            }
            yield time, gait.with_changes(**asked)
