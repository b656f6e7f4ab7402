"""Thermal constants of joints' motors, published or assumed by mass, and what follows from them."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.drive.winding import (
    HOUSING_RESISTANCE,
    MAGNET,
    WINDING_RESISTANCE,
    Winding,
    assumed_constants,
)
from hexapod_pin.results.sizing.demand import JointDemand, largest_lagged
from hexapod_pin.results.sizing.motor_current import (
    current_per_torque,
    mean_square_current,
    motor_current,
    resistance,
)
from hexapod_pin.results.sizing.motors import Motors

SPREAD = 2.0
"""Factor on both thermal resistances, up and down, that the sources leave (*assumed*)."""

WINDING_LIMIT = 100.0
"""Highest temperature of a winding where no maker states one [deg C] (*assumed*)."""

THERMAL_RULE = (
    f"thermal constants assumed by mass m: winding to housing {WINDING_RESISTANCE:g} K/W, housing "
    f"to surroundings {HOUSING_RESISTANCE:g} K/W, both times (1 kg / m)^(2/3) and uncertain by a "
    f"factor of {SPREAD:g}; winding up to {WINDING_LIMIT:g} deg C (docs/motors.md)"
)


class Thermal(NamedTuple):
    """Thermal constants of the motors of n joints, arrays (n,); NaN where they are not known.

    Attributes:
        cool: those at which a motor stays coolest.
        middle: the published ones, or the middle of those that are assumed.
        hot: those at which it gets hottest; all three are equal where they are published.
        known: whether they are published.
        limit: highest temperature of the winding [deg C]; NaN where published constants lack it.
    """

    cool: Winding
    middle: Winding
    hot: Winding
    known: Array
    limit: Array


def thermal_of(motors: Motors) -> Thermal:
    """Return the thermal constants of joints' motors: published, else assumed by mass."""
    ohm = resistance(motors)
    complete = zip(motors.records, motors.heat_known, strict=True)
    known = [winding_of(row) if known else None for row, known in complete]
    masses = [np.nan if row.mass is None else row.mass for row in motors.records]

    def constants(factor: float) -> Winding:
        rows = [
            (w.resistance, w.to_housing, w.to_ambient, w.winding_time, w.housing_time)
            if w is not None
            else (ohm[j], *assumed_constants(masses[j], factor))
            for j, w in enumerate(known)
        ]
        return replace(Winding(*np.array(rows).T), magnet=MAGNET)

    limits = [
        np.nan if row.winding_temperature_max is None and w is not None
        else WINDING_LIMIT if row.winding_temperature_max is None
        else row.winding_temperature_max
        for row, w in zip(motors.records, known, strict=True)
    ]  # fmt: skip
    return Thermal(
        constants(1.0 / SPREAD), constants(1.0), constants(SPREAD),
        np.array([w is not None for w in known]), np.array(limits),
    )  # fmt: skip


def winding_of(row: MotorRecord) -> Winding | None:
    """Return the thermal constants of a row of the catalogue; None where one is missing."""
    found = (
        row.winding_resistance, row.thermal_resistance_winding, row.thermal_resistance_housing,
        row.thermal_time_winding, row.thermal_time_housing,
    )  # fmt: skip
    known = [value for value in found if value is not None]
    return replace(Winding(*known), magnet=MAGNET) if len(known) == len(found) else None


def thermal_constant(row: MotorRecord) -> float | None:
    """Return the time constant over which heat counts [s]: the winding's, else the housing's."""
    return row.thermal_time_winding or row.thermal_time_housing


def winding_numbers(demand: JointDemand, motors: Motors, ambient: float) -> dict[str, Array]:
    """Return temperatures of lasting walking and standing, named as in `MotorUse` (n,) [deg C].

    The current is the motor's own (`motor_current`). The ripple within a cycle counts where the
    constants are published; with assumed ones it is far within their spread.
    """
    thermal = thermal_of(motors)
    mean = mean_square_current(demand, motors)
    rest = (current_per_torque(motors) * np.nan_to_num(demand.standing)) ** 2
    middle = np.asarray(thermal.middle.lasting(mean, ambient))  # type: ignore[arg-type]
    ends = [
        np.maximum(w.lasting(mean, ambient), w.lasting(rest, ambient))  # type: ignore[arg-type]
        for w in (thermal.cool, thermal.hot)
    ]
    if thermal.known.any():
        moving = mean + _ripple(demand, motors, thermal)
        with_ripple = thermal.middle.hottest(mean, moving, ambient)  # type: ignore[arg-type]
        middle = np.where(thermal.known, with_ripple, middle)
        ends = [np.where(thermal.known, np.maximum(with_ripple, end), end) for end in ends]
    return {
        "winding_temperature": middle, "winding_cool": ends[0], "winding_hot": ends[1],
        "winding_limit": thermal.limit,
    }  # fmt: skip


def _ripple(demand: JointDemand, motors: Motors, thermal: Thermal) -> Array:
    """Return by how much a winding's lag of the current's square exceeds its mean (n,) [A^2]."""
    square = motor_current(demand, motors) ** 2
    found = np.zeros(square.shape[1])
    for j in np.flatnonzero(thermal.known):
        column = square[:, [j]]
        moving = largest_lagged(demand.time, column, float(thermal.middle.winding_time[j]))  # type: ignore[index]
        found[j] = moving[0] - (demand.weights @ column)[0]
    return found


def lasting_torque(motors: Motors, ambient: float = 25.0) -> Array:
    """Return the torque that joints' motors may give for ever (n,) [N m].

    Where thermal constants and limit of the winding are published: the torque at which it comes to
    that limit. Else the same share of the stall torque for every maker (`Derating.continuous`).
    """
    derated = np.array([motors.derating.continuous_torque(row) for row in motors.records])
    thermal = thermal_of(motors)
    square = thermal.middle.allowed_square(thermal.limit, ambient)  # type: ignore[arg-type]
    by_heat = np.sqrt(square) / current_per_torque(motors)
    return np.where(thermal.known & np.isfinite(thermal.limit), by_heat, derated)


def lasting_torque_of(record: MotorRecord, derating: Derating) -> float:
    """Return `lasting_torque` of one row of the catalogue [N m]."""
    return float(lasting_torque(Motors.of(("all",), record, derating))[0])
