"""An hour of walking: temperatures of windings and housings from one steady cycle.

The copper losses of a cycle are averaged, with the resistance and the torque constant at the
temperatures of the moment, and the two thermal bodies of every joint's motor follow them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.drive.winding import MELTED, two_body_course
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_current import mean_square_current
from hexapod_pin.results.sizing.motors import Motors
from hexapod_pin.results.sizing.winding import THERMAL_RULE, thermal_of
from hexapod_pin.text_table import Table

TIMES = 61
"""Times at which temperatures are kept, evenly spread: of an hour every minute."""


@dataclass(frozen=True)
class WalkingHeat(Immutable):
    """Temperatures of n joints' motors in lasting walking, from cold; NaN where unknown.

    The ripple within a cycle is not in it.

    Attributes:
        joint_names: n names.
        time: since the start [s]. Shape (T,).
        winding: of the windings [deg C]. Shape (T, n).
        housing: of the housings [deg C]. Shape (T, n).
        winding_cool: at the end, with the thermal constants at which a motor stays coolest (n,)
            [deg C]; as `winding` where they are published.
        winding_hot: with those at which it gets hottest (n,) [deg C].
        limit: highest temperature of the winding that is allowed (n,) [deg C].
        published: whether the thermal constants are the maker's, or *assumed*. Shape (n,).
    """

    joint_names: tuple[str, ...]
    time: Array
    winding: Array
    housing: Array
    winding_cool: Array
    winding_hot: Array
    limit: Array
    published: Array

    @property
    def hottest(self) -> int | None:
        """Index of the joint whose winding is hottest at the end; None where none is known."""
        end = self.winding[-1]
        return None if np.isnan(end).all() else int(np.nanargmax(end))

    @property
    def decides(self) -> bool:
        """Whether a winding may come above its limit within the spread of the constants."""
        return bool(np.any(self.winding_hot > self.limit))

    @property
    def line(self) -> str:
        """The hottest winding at the end in one line."""
        j, after = self.hottest, _duration(float(self.time[-1]))
        if j is None:
            return f"after {after}: temperatures unknown"
        text = f"after {after}: winding {_degrees(self.winding[-1, j])} ({self.joint_names[j]})"
        if self.published[j]:
            return f"{text}, {self.limit[j]:.0f} allowed"
        ends = f"{self.winding_cool[j]:.0f} to {_degrees(self.winding_hot[j])}"
        return f"{text}, {ends} by assumed constants, {self.limit[j]:.0f} allowed"

    def table_lines(self) -> list[str]:
        """Return the temperatures of every joint after a tenth of the time and at the end."""
        early = int(np.argmin(np.abs(self.time - 0.1 * self.time[-1])))
        head = (
            "", f"winding\n{_duration(float(self.time[early]))}", "\nend", "\nat best",
            "\nat worst", "housing\nend", "constants",
        )  # fmt: skip
        rows = [
            [
                name,
                *(
                    None if math.isnan(x) else f"{x:.0f}"
                    for x in (
                        self.winding[early, j], self.winding[-1, j], self.winding_cool[j],
                        self.winding_hot[j], self.housing[-1, j],
                    )
                ),
                "published" if self.published[j] else "assumed",
            ]
            for j, name in enumerate(self.joint_names)
        ]  # fmt: skip
        after = _duration(float(self.time[-1]))
        title = f"Temperatures after {after} of this walk from cold [deg C]"
        lines = Table(title, head, rows, "<>", missing="unknown").lines()
        return lines if self.published.all() else [*lines, f"  {THERMAL_RULE}"]


def _degrees(value: float) -> str:
    return f"{value:.0f} degC" if value < MELTED else f"above {MELTED:.0f} degC"


def _duration(seconds: float) -> str:
    if seconds == 3600.0:
        return "an hour"
    return f"{seconds / 60.0:.3g} min" if seconds >= 60.0 else f"{seconds:.3g} s"


@checked
def walking_heat(
    demand: JointDemand,
    record: MotorRecord | Mapping[str, MotorRecord],
    *,
    duration: float = 3600.0,
    ambient: float = 25.0,
) -> WalkingHeat:
    """Return the temperatures of joints' motors while a walk goes on, from its steady cycle.

    The loss of a winding is R i^2 averaged over the demand's window, i the motor's own current with
    the losses of an identified gear. Resistance and current grow with temperature: copper 0.39 %,
    magnets 0.11 % a kelvin. Two thermal bodies follow: winding and housing. Constants are those of
    the catalogue's row, else *assumed* by the motor's mass with a spread (docs/motors.md).

    Args:
        demand: what the joints of a steady walk need.
        record: the motor of all joints, or motors by kind of joint.
        duration: of the walk from cold [s].
        ambient: temperature of the surroundings [deg C], *assumed*.

    Raises:
        ParameterError: a duration or temperature that cannot be; a row without a no-load speed, or
            a kind of joint without a motor.

    Example:
        >>> heat = hp.sizing.walking_heat(demand, hp.load_catalog().get("MX-64", 12.0))
        >>> print(heat.line)
    """
    if not 0.0 < duration <= LONGEST:
        raise ParameterError("duration", duration, f"above 0, up to {LONGEST:g} s")
    check_ambient(ambient)
    kinds: Sequence[str] = demand.joint_kinds
    if isinstance(record, Mapping) and (missing := sorted(set(kinds) - set(record))):
        raise ParameterError("record", sorted(record), f"given with a motor of {missing}")
    return heat_course(demand, Motors.of(kinds, record, Derating()), duration, ambient)


LONGEST = 1e6
"""Longest walk whose temperatures are followed [s]."""


def check_ambient(ambient: float) -> None:
    """Refuse a temperature of the surroundings that is none.

    Raises:
        ParameterError: it is not between -100 and 200 deg C.
    """
    if not -100.0 <= ambient <= 200.0:
        raise ParameterError("ambient", ambient, "-100 to 200 [deg C]")


def heat_course(
    demand: JointDemand, motors: Motors, duration: float, ambient: float
) -> WalkingHeat:
    """Return `walking_heat` of joints' motors."""
    thermal, square = thermal_of(motors), mean_square_current(demand, motors)
    time = np.linspace(0.0, duration, TIMES)
    known = np.isfinite(square + np.asarray(thermal.middle.to_housing))
    count = len(square)
    courses = []
    for winding, times in ((thermal.middle, time), (thermal.cool, time[-1:]),
                           (thermal.hot, time[-1:])):  # fmt: skip
        whole = np.full((len(times), 2, count), np.nan)
        if known.any():
            chosen = winding.of(known)
            whole[:, :, known] = two_body_course(chosen, square[known], times, ambient)
        courses.append(whole)
    middle, *ends = courses
    cool, hot = (np.where(thermal.known, middle[-1, 0], end[-1, 0]) for end in ends)
    return WalkingHeat(
        demand.joint_names, time, middle[:, 0], middle[:, 1], cool, hot, thermal.limit,
        thermal.known,
    )  # fmt: skip
