"""The inputs that a study can vary: names, units, ranges, and what of a case each changes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

GAIT, CONTACT, SERVO, TERRAIN, GRAVITY, LOADS = (
    "controller", "contact", "servo", "terrain", "gravity", "loads",
)  # fmt: skip
"""The parts of a case that inputs change."""


@dataclass(frozen=True)
class InputKind:
    """What an input is.

    Attributes:
        name: in the study file.
        unit: of its values; "-" without one, empty of names.
        part: of the case, that it changes.
        meaning: in words.
        low: smallest value.
        high: largest value.
        open_low: whether the smallest value itself is refused.
        open_high: whether the largest value itself is refused.
        whole: whether values are whole numbers.
        words: whether values are names.
        options: further keys of its table in the file, with their defaults.
        same_as: name of the input that changes the same number, where there is one.
    """

    name: str
    unit: str
    part: str
    meaning: str
    low: float = -math.inf
    high: float = math.inf
    open_low: bool = False
    open_high: bool = False
    whole: bool = False
    words: bool = False
    options: Mapping[str, float | str | None] = field(default_factory=dict)
    same_as: str = ""

    def allows(self, value: object) -> bool:
        """Return whether a value is in the range of the input."""
        if self.words:
            return isinstance(value, str) and bool(value)
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        number = float(value)
        above = number > self.low if self.open_low else number >= self.low
        below = number < self.high if self.open_high else number <= self.high
        return math.isfinite(number) and above and below and (not self.whole or number % 1.0 == 0.0)

    @property
    def allowed(self) -> str:
        """The range in words, with its unit."""
        if self.words:
            return "a name"
        low = "" if self.low == -math.inf else f"{'above' if self.open_low else 'at least'} "
        high = "" if self.high == math.inf else f"{'below' if self.open_high else 'at most'} "
        ends = [f"{low}{self.low:g}"] * bool(low) + [f"{high}{self.high:g}"] * bool(high)
        kind = "a whole number" if self.whole else "a number"
        unit = f" [{self.unit}]"
        return f"{kind} {' and '.join(ends)}{unit}" if ends else f"a finite number{unit}"


def _factor(name: str, part: str, of: str) -> InputKind:
    return InputKind(name, "-", part, f"factor on {of}", 0.0, open_low=True)


_MAX_SLOPE = 0.5 * math.pi

_KINDS = (
    InputKind("gait", "", GAIT, "gait by name", words=True),
    InputKind("stroke", "m", GAIT, "stroke", 0.0),
    InputKind("cycle_time", "s", GAIT, "cycle time", 0.0, open_low=True),
    InputKind("duty", "-", GAIT, "share of the cycle on the ground", 0.0, 1.0,
              open_low=True, open_high=True),
    InputKind("lift", "m", GAIT, "height of the swing foot", 0.0),
    InputKind("speed", "m/s", GAIT, "walking speed", 0.0, open_low=True),
    InputKind("heading", "rad", GAIT, "direction of travel, left > 0"),
    InputKind("heading_deg", "deg", GAIT, "direction of travel, left > 0", same_as="heading"),
    InputKind("turn_rate", "rad/s", GAIT, "yaw rate, left > 0"),
    InputKind("turn_rate_deg", "deg/s", GAIT, "yaw rate, left > 0", same_as="turn_rate"),
    InputKind("payload", "kg", LOADS, "mass of a payload", 0.0,
              options={"link": None, "position": None}),
    InputKind("friction", "-", CONTACT, "friction coefficient", 0.0),
    _factor("mass", LOADS, "mass and inertia of all links"),
    _factor("trunk_mass", LOADS, "mass and inertia of the trunk"),
    _factor("contact_stiffness", CONTACT, "the stiffness of the contact"),
    _factor("servo_stiffness", SERVO, "stiffness and damping of the servos"),
    InputKind("motor", "", SERVO, "motor of the catalogue", words=True),
    InputKind("voltage", "V", SERVO, "voltage of the supply", 0.0, open_low=True),
    InputKind("slope", "rad", GRAVITY, "slope of the ground, rising along +x",
              -_MAX_SLOPE, _MAX_SLOPE, open_low=True, open_high=True),
    InputKind("slope_deg", "deg", GRAVITY, "slope of the ground, rising along +x",
              -90.0, 90.0, open_low=True, open_high=True, same_as="slope"),
    InputKind("bumps", "m", TERRAIN, "largest height and depth of random bumps", 0.0,
              options={"wavelength": 0.4, "length": None, "flat_radius": None}),
    InputKind("bumps_seed", "-", TERRAIN, "which random bumps", 0.0, 2.0**53, whole=True),
)  # fmt: skip

INPUTS: Mapping[str, InputKind] = MappingProxyType({kind.name: kind for kind in _KINDS})
"""The inputs by name."""
