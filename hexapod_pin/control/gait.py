"""Gaits: which foot is placed when, how far, how high and where to.

A gait is a periodic table. Leg i is placed on the ground at the times (k + phases[i]) cycle_time,
stays for duty * cycle_time, and swings for the rest: a swing ends at its placement. Legs are in
the order lf lm lr rf rm rr.
[S2]'s leg numbers 1..6 are lf rf lm rm lr rr (odd = left: *assumed*, the paper does not say).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from hexapod_pin.control.phase_table import (
    MIN_FEET_DOWN,
    MIN_WAVE_DUTY,
    PHASE_TOLERANCE,
    age_at_placements,
    smallest_duty,
    wave_phases,
)
from hexapod_pin.errors import GaitError, UnknownNameError
from hexapod_pin.spec import Spec

LEG_ORDER = ("lf", "lm", "lr", "rf", "rm", "rr")
"""Legs in the order of `Gait.phases`."""

Phase = Annotated[float, Field(ge=0.0, lt=1.0)]


class Gait(Spec):
    """A periodic gait with its stroke, timing and direction.

    Attributes:
        name: what it is called.
        phases: placement of each leg as a fraction of the cycle, legs lf lm lr rf rm rr.
        duty: share of the cycle a foot is on the ground, below 1.
        stroke: travel of the body while one foot is on the ground [m]; 0 turns on the spot.
        cycle_time: [s].
        lift: height of the swing foot at mid-swing [m]. The default is *assumed*; [S2] lifts by a
            femur angle of 6 degrees, about 0.013 m.
        heading: direction of travel, 0 = forward, pi/2 = left [rad].
        turn_rate: yaw rate of the body, positive to the left [rad/s].

    Stroke and cycle time default to those of [S2].

    Raises:
        ParameterError: a parameter is outside its range or not finite.
        GaitError: fewer than three feet are down at some instant; `limit` is the smallest duty.
    """

    name: str = Field(default="custom", min_length=1)
    phases: tuple[Phase, Phase, Phase, Phase, Phase, Phase]
    duty: float = Field(gt=0.0, lt=1.0)
    stroke: float = Field(default=0.14, ge=0.0)
    cycle_time: float = Field(default=2.4, gt=0.0)
    lift: float = Field(default=0.02, ge=0.0)
    heading: float = 0.0
    turn_rate: float = 0.0

    def __init__(self, /, **fields: Any) -> None:
        """Validate the fields, then refuse a gait that cannot stand."""
        super().__init__(**fields)
        if self.minimum_feet_down < MIN_FEET_DOWN:
            smallest = smallest_duty(self.phases)
            raise GaitError(
                f"gait {self.name}: duty = {self.duty:g} leaves {self.minimum_feet_down} feet on "
                f"the ground at some instant; these phases need a duty of at least {smallest:.6g} "
                f"to keep {MIN_FEET_DOWN} down.",
                "duty",
                smallest,
            )

    @property
    def speed(self) -> float:
        """Walking speed, stroke / (duty * cycle_time) [m/s]."""
        return self.stroke / (self.duty * self.cycle_time)

    def with_changes(self, **fields: float) -> Gait:
        """Return the gait with some fields replaced, validated."""
        return Gait(**{**self.model_dump(), **fields})

    def in_one_second(self) -> Gait:
        """Return the gait of the same paths with a cycle of 1 s.

        Places at a share of the cycle are the same; rates are those of this gait times its cycle
        time. What does not depend on time need be found only once for all cycle times.
        """
        turn = self.turn_rate * self.cycle_time
        return self.with_changes(cycle_time=1.0, turn_rate=turn)

    @property
    def minimum_feet_down(self) -> int:
        """Smallest number of feet on the ground at any time, instants of exchange aside."""
        down = age_at_placements(self.phases) <= self.duty + PHASE_TOLERANCE
        return int(down.sum(axis=1).min())

    def feet_down(self, phase: ArrayLike) -> NDArray[np.bool_]:
        """Return which feet the schedule puts on the ground.

        Args:
            phase: time as a fraction of the cycle, any real number. Shape (...).

        Returns:
            True from placement until lift-off. Shape (..., 6).
        """
        age = np.mod(np.asarray(phase, dtype=float)[..., None] - np.array(self.phases), 1.0)
        age = np.where(age > 1.0 - PHASE_TOLERANCE, 0.0, age)
        return np.asarray(age < self.duty - PHASE_TOLERANCE)

    @classmethod
    def tripod(cls, **fields: Any) -> Gait:
        """Two sets of three legs take turns (duty 1/2)."""
        return cls._named("tripod", (0.0, 0.5, 0.0, 0.5, 0.0, 0.5), 1 / 2, fields)

    @classmethod
    def tetrapod(cls, **fields: Any) -> Gait:
        """[S2]'s gait (duty 2/3): legs (2, 3) swing first, then (1, 6), then (4, 5).

        The two sides are 2/3 of a cycle apart, not 1/2, so loads differ between left and right.
        """
        return cls._named("tetrapod", (2 / 3, 1 / 3, 0.0, 1 / 3, 0.0, 2 / 3), 2 / 3, fields)

    @classmethod
    def ripple(cls, **fields: Any) -> Gait:
        """One leg after the other: rf, lr, rm, lf, rr, lm (duty 2/3, overlapping swings).

        Many tables go by this name; this is `ripple_gait` of OpenSHC (config/gait.yaml, "step
        order AR, CL, BR, AL, CR, BL"), whose sides step front to rear. For waves that run rear to
        front with the same duty take `wave(2/3)`.
        """
        return cls._named("ripple", (1 / 2, 5 / 6, 1 / 6, 0.0, 1 / 3, 2 / 3), 2 / 3, fields)

    @classmethod
    def wave(cls, duty: float = 5 / 6, **fields: Any) -> Gait:
        """Symmetric wave gait of Song and Waldron: rear-to-front waves, sides 1/2 apart.

        Args:
            duty: 1/2 (the tripod) or more, below 1.
            fields: stroke, cycle_time, lift, heading, turn_rate, name.

        Raises:
            GaitError: the duty is below 1/2.
        """
        if 0.0 < duty < MIN_WAVE_DUTY - PHASE_TOLERANCE:
            raise GaitError(
                f"gait wave: duty = {duty:g} leaves fewer than {MIN_FEET_DOWN} feet on the ground; "
                f"a wave gait needs a duty of at least {MIN_WAVE_DUTY:g}.",
                "duty",
                MIN_WAVE_DUTY,
            )
        phases = wave_phases(duty if MIN_WAVE_DUTY <= duty < 1.0 else MIN_WAVE_DUTY)
        return cls._named("wave", phases, duty, fields)

    @classmethod
    def custom(cls, phases: ArrayLike, duty: float, **fields: Any) -> Gait:
        """Build a gait from its own table.

        Args:
            phases: placements as fractions of the cycle, legs lf lm lr rf rm rr. Shape (6,).
            duty: share of the cycle on the ground.
            fields: stroke, cycle_time, lift, heading, turn_rate, name.
        """
        return cls(phases=tuple(np.asarray(phases).tolist()), duty=duty, **fields)

    @staticmethod
    def by_name(name: str, **fields: Any) -> Gait:
        """Build one of GAITS from its name; the wave also takes `duty=`.

        Raises:
            UnknownNameError: there is no such gait.
        """
        if name not in GAITS:
            raise UnknownNameError("gait", name, list(GAITS))
        return GAITS[name](**fields)

    @classmethod
    def _named(
        cls, name: str, phases: tuple[float, ...], duty: float, fields: dict[str, Any]
    ) -> Gait:
        """Build a gait whose table is given, unless `fields` overrides a part of it."""
        return cls(**{"name": name, "phases": phases, "duty": duty, **fields})


GAITS: Mapping[str, Callable[..., Gait]] = MappingProxyType(
    {"tripod": Gait.tripod, "ripple": Gait.ripple, "tetrapod": Gait.tetrapod, "wave": Gait.wave}
)
"""The gaits that have a name, and what builds each from its fields."""
