"""A gait defines which foot is placed when, how far, how high and in which direction.

A gait is a periodic table. Leg i is placed on the ground at the times (k + phases[i]) cycle_time,
stays for duty * cycle_time, and swings for the rest: a swing ends at its placement. Six legs are
in the order lf lm lr rf rm rr; 4, 5, 7 or 8 legs as `leg_order` gives it: left from front to rear,
then right from front to rear.
[S2]'s leg numbers 1..6 are lf rf lm rm lr rr (odd = left: *assumed*, not given in the paper).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_serializer

from hexapod_pin.errors import GaitError, ParameterError, UnknownNameError
from hexapod_pin.spec import Metres, Radians, Spec

if TYPE_CHECKING:
    from pydantic import SerializerFunctionWrapHandler


# Phase tables of gaits: when each foot is placed, as a fraction of the cycle.

MIN_FEET_DOWN = 3
"""A robot on fewer feet than this falls."""

PHASE_TOLERANCE = 1e-9
"""Phases closer than this are one event [cycles]."""


def smallest_wave_duty(legs: int) -> float:
    """Return the smallest duty of a wave gait: three feet are down at any time."""
    return MIN_FEET_DOWN / legs


def usual_wave_duty(legs: int) -> float:
    """Return the duty of a wave gait where none is given: at most one foot is in the air.

    With four legs 5/6 and not 3/4, at which the longitudinal stability margin of the wave gait,
    (duty - 3/4) stroke / duty, is zero (McGhee and Frank 1968).
    """
    return max(5.0 / 6.0, (legs - 1.0) / legs)


def wave_phases(duty: float, legs: int = 6) -> tuple[float, ...]:
    """Return the placements of a wave gait, legs left front to rear, then right front to rear.

    With an even number of legs frac(m duty) of the m-th leg from the front, right side + 1/2: the
    wave gait of Song and Waldron. With an odd number even phases around the robot, from the front
    over the left to the rear and back on the right.
    """
    side = (legs + 1) // 2
    if legs % 2:
        around = [*range(side), *reversed(range(side, legs))]
        return tuple(m / legs for m in around)
    left = [_fraction(m * duty) for m in range(side)]
    return tuple(left + [_fraction(phase + 0.5) for phase in left])


def smallest_duty(phases: ArrayLike) -> float:
    """Return the smallest duty that keeps three feet down at any time with these placements."""
    return float(np.sort(age_at_placements(phases), axis=1)[:, MIN_FEET_DOWN - 1].max())


def age_at_placements(phases: ArrayLike) -> NDArray[np.float64]:
    """Return the time since each foot's placement, just before each leg's placement.

    The number of feet down is smallest just before a placement, so these instants decide.

    Returns:
        Row j, column i: age of foot i just before leg j is placed, in (0, 1]. Shape (L, L).
    """
    placed = np.asarray(phases, dtype=float)
    age = np.mod(placed[:, None] - placed[None, :], 1.0)
    return np.where(age < PHASE_TOLERANCE, 1.0, age)


def _fraction(value: float) -> float:
    """Return the fractional part, with rounding just below 1 taken as 0."""
    part = float(np.mod(value, 1.0))
    return 0.0 if part > 1.0 - PHASE_TOLERANCE else part


# Gaits: phases with stroke, lift, timing and direction.

LEG_ORDER = ("lf", "lm", "lr", "rf", "rm", "rr")
"""Six legs in the order of `Gait.phases`."""

LEG_COUNTS = (4, 5, 6, 7, 8)
"""Numbers of legs for which there are gaits."""

Phase = Annotated[float, Field(ge=0.0, lt=1.0)]

LONGEST_CYCLE = 1e4
"""Longest cycle of a gait [s]."""


class Gait(Spec):
    """A periodic gait with its stroke, timing and direction.

    Attributes:
        name: of the gait.
        phases: placement of each leg as a fraction of the cycle, legs lf lm lr rf rm rr; four to
            eight of them. They may be given as a mapping, leg's name -> phase.
        leg_names: the legs that `phases` belong to, where they were given as a mapping and are not
            lf lm lr rf rm rr; None: in the order above.
        duty: share of the cycle a foot is on the ground, below 1; the same for all feet.
        stroke: travel of the body while one foot is on the ground [m]; 0 turns on the spot.
        cycle_time: from 0.001 to 10000 s [s].
        lift: height of the swing foot at mid-swing [m]. The default is *assumed*; [S2] lifts by a
            femur angle of 6 degrees, about 0.013 m.
        heading: direction of travel, 0 = forward, pi/2 = left [rad].
        turn_rate: yaw rate of the body, positive to the left [rad/s].

    Stroke and cycle time default to those of [S2].

    Raises:
        ParameterError: a parameter is outside its range or not finite, or not four to eight phases.
        GaitError: fewer than three feet are down at some instant; `limit` is the smallest duty.
    """

    name: str = Field(default="custom", min_length=1)
    phases: Annotated[tuple[Phase, ...], Field(min_length=4, max_length=8)]
    duty: float = Field(gt=0.0, lt=1.0)
    stroke: Metres = Field(default=0.14, ge=0.0)
    cycle_time: float = Field(default=2.4, ge=1e-3, le=LONGEST_CYCLE)
    lift: Metres = Field(default=0.02, ge=0.0)
    heading: Radians = 0.0
    turn_rate: Radians = 0.0
    leg_names: tuple[str, ...] | None = None

    def __init__(self, /, **fields: Any) -> None:
        """Validate the fields, then refuse a gait that cannot stand."""
        super().__init__(**_by_order(fields))
        if self.leg_names is not None and len(set(self.leg_names)) != len(self.phases):
            allowed = f"{len(self.phases)} different names, one for each phase"
            raise ParameterError("Gait.leg_names", self.leg_names, allowed)
        if self.minimum_feet_down < MIN_FEET_DOWN:
            smallest = smallest_duty(self.phases)
            raise GaitError(
                f"gait {self.name}: duty = {self.duty:g} leaves {self.minimum_feet_down} feet on "
                f"the ground at some instant; these phases need a duty of at least {smallest:.6g} "
                f"to keep {MIN_FEET_DOWN} down.",
                "duty",
                smallest,
            )

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {name: value for name, value in dump(self).items() if value is not None}

    @property
    def speed(self) -> float:
        """Walking speed, stroke / (duty * cycle_time) [m/s]."""
        return self.stroke / (self.duty * self.cycle_time)

    def with_changes(self, **fields: Any) -> Gait:
        """Return the gait with some fields replaced, validated."""
        return Gait(**{**self.model_dump(), **fields})

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as TOML-able data."""
        fields = self.model_dump()
        return {name: list(x) if isinstance(x, tuple) else x for name, x in fields.items()}

    def in_one_second(self) -> Gait:
        """Return the gait of the same paths with a cycle of 1 s.

        Places at a share of the cycle are the same; rates are those of this gait times its cycle
        time. What does not depend on time need be found only once for all cycle times.
        """
        turn = self.turn_rate * self.cycle_time
        found = self.with_changes(cycle_time=1.0, turn_rate=0.0)
        return found.model_copy(update={"turn_rate": turn})  # of a slow cycle more than a turn

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
            True from placement until lift-off. Shape (..., L).
        """
        age = np.mod(np.asarray(phase, dtype=float)[..., None] - np.array(self.phases), 1.0)
        age = np.where(age > 1.0 - PHASE_TOLERANCE, 0.0, age)
        return np.asarray(age < self.duty - PHASE_TOLERANCE)

    @classmethod
    def tripod(cls, **fields: Any) -> Gait:
        """Two sets of three legs take turns (duty 1/2)."""
        return cls._named("tripod", (0.0, 0.5, 0.0, 0.5, 0.0, 0.5), 1 / 2, fields)

    @classmethod
    def tetrapod(cls, *, legs: int = 6, **fields: Any) -> Gait:
        """[S2]'s gait (duty 2/3): legs (2, 3) swing first, then (1, 6), then (4, 5).

        The two sides are 2/3 of a cycle apart, not 1/2, so loads differ between left and right.
        Eight legs: two sets of four, each second leg of a side, take turns (duty 1/2).

        Raises:
            GaitError: other than six or eight legs.
        """
        if legs == 8:
            return cls._named("tetrapod", (0.0, 0.5, 0.0, 0.5, 0.5, 0.0, 0.5, 0.0), 1 / 2, fields)
        if legs != 6:
            raise GaitError(_no_table("tetrapod", legs), "legs", None)
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
    def wave(cls, duty: float | None = None, *, legs: int = 6, **fields: Any) -> Gait:
        """Symmetric wave gait of Song and Waldron: rear-to-front waves, sides 1/2 apart.

        With an odd number of legs one after the other around the robot. With six legs duty 5/6 has
        six beats, 3/4 four (two feet placed at once), 1/2 two (the tripod).

        Args:
            duty: 3 / legs (1/2 with six, the tripod) or more, below 1; None: 5/6, and above six
                legs (legs - 1) / legs.
            legs: their number, four to eight.
            fields: stroke, cycle_time, lift, heading, turn_rate, name.

        Raises:
            GaitError: the duty is below 3 / legs, or another number of legs.
        """
        if legs not in LEG_COUNTS:
            raise GaitError(_no_table("wave", legs), "legs", None)
        duty = usual_wave_duty(legs) if duty is None else float(duty)
        least = smallest_wave_duty(legs)
        if 0.0 < duty < least - PHASE_TOLERANCE:
            raise GaitError(
                f"gait wave: duty = {duty:g} leaves fewer than {MIN_FEET_DOWN} feet on the ground; "
                f"a wave gait needs a duty of at least {least:g}.",
                "duty",
                least,
            )
        phases = wave_phases(duty if least <= duty < 1.0 else least, legs)
        return cls._named("wave", phases, duty, fields)

    @classmethod
    def custom(cls, phases: ArrayLike | Mapping[str, float], duty: float, **fields: Any) -> Gait:
        """Build a gait from its own table.

        Args:
            phases: placements as fractions of the cycle, legs lf lm lr rf rm rr, shape (L,); or
                leg's name -> placement.
            duty: share of the cycle on the ground.
            fields: stroke, cycle_time, lift, heading, turn_rate, name.
        """
        if not isinstance(phases, Mapping):
            phases = tuple(np.atleast_1d(phases).tolist())
        return cls(phases=phases, duty=duty, **fields)

    @staticmethod
    def by_name(name: str, *, legs: int = 6, **fields: Any) -> Gait:
        """Build one of GAITS from its name for a number of legs; the wave also takes `duty=`.

        Raises:
            UnknownNameError: there is no such gait, or none of that name for so many legs; it
                lists those that fit.
        """
        if name not in GAITS:
            raise UnknownNameError("gait", name, list(GAITS))
        if name not in gaits_for(legs):
            raise UnknownNameError(f"gait of {legs} legs", name, list(gaits_for(legs)))
        return GAITS[name](**fields) if legs == 6 else GAITS[name](legs=legs, **fields)

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


def gaits_for(legs: int) -> tuple[str, ...]:
    """Return the names of the gaits that a robot of so many legs can walk; of GAITS."""
    if legs == 6:
        return tuple(GAITS)
    if legs == 8:
        return ("tetrapod", "wave")
    return ("wave",) if legs in LEG_COUNTS else ()


def _no_table(name: str, legs: int) -> str:
    """Say which gaits a number of legs has instead of one."""
    fitting = ", ".join(gaits_for(legs)) or "none: a robot walks on 4 to 8 legs"
    return f"gait {name} has no table for {legs} legs; gaits that fit: {fitting}."


def _by_order(fields: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a gait with phases given as a mapping turned into a tuple."""
    phases = fields.get("phases")
    if not isinstance(phases, Mapping):
        return fields
    if sorted(phases) == sorted(LEG_ORDER):
        return {**fields, "phases": tuple(phases[leg] for leg in LEG_ORDER)}
    return {**fields, "phases": tuple(phases.values()), "leg_names": tuple(phases)}
