"""Columns of a file of motors: what each is called, and in which units it may stand."""

from __future__ import annotations

import math
from typing import NamedTuple

KGF = 9.80665
"""Standard gravity: weight of a kilogram [N]."""

RPM = 2.0 * math.pi / 60.0
"""A turn per minute [rad/s]."""


class Column(NamedTuple):
    """A column of numbers.

    Attributes:
        field: of `MotorRecord`, in SI units (temperatures in deg C).
        units: what a header's end says, with the factor to the field's unit; "" of a number without
            unit. The first is how the package writes it.
    """

    field: str
    units: dict[str, float]


TORQUE = {"Nm": 1.0, "mNm": 1e-3, "kgf_cm": 0.01 * KGF, "kgcm": 0.01 * KGF, "ozf_in": 0.00706155}
SPEED = {"rad_s": 1.0, "rpm": RPM, "deg_s": math.pi / 180.0}
CURRENT = {"A": 1.0, "mA": 1e-3}
INERTIA = {"kgm2": 1.0, "gcm2": 1e-7}

NUMBERS = (
    Column("voltage", {"V": 1.0}),
    Column("voltage_min", {"V": 1.0}),
    Column("voltage_max", {"V": 1.0}),
    Column("stall_torque", TORQUE),
    Column("no_load_speed", SPEED),
    Column("stall_current", CURRENT),
    Column("standby_current", CURRENT),
    Column("rated_torque", TORQUE),
    Column("mass", {"kg": 1.0, "g": 1e-3}),
    Column("gear_ratio", {"": 1.0}),
    Column("armature", INERTIA),
    Column("winding_resistance", {"ohm": 1.0}),
    Column("torque_constant", {"Nm_A": 1.0, "mNm_A": 1e-3}),
    Column("thermal_resistance_winding", {"K_W": 1.0}),
    Column("thermal_resistance_housing", {"K_W": 1.0}),
    Column("thermal_time_winding", {"s": 1.0}),
    Column("thermal_time_housing", {"s": 1.0}),
    Column("winding_temperature_max", {"degC": 1.0}),
    Column("price", {"": 1.0}),
)

TEXTS = (
    "model", "maker", "motor_type", "armature_source", "currency", "source", "note", "uncertain",
)  # fmt: skip

REQUIRED = ("model", "voltage", "stall_torque", "no_load_speed", "mass")
"""Fields whose columns must be there; cells of speed and mass may be empty."""

COMPUTED = frozenset(
    (
        "derated_torque_Nm_stall_over_5", "kt_output_Nm_per_A_est", "resistance_ohm_est",
        "implied_drivetrain_efficiency_est", "stall_torque_per_mass_Nm_kg",
    )
)  # fmt: skip
"""Columns that follow from others: read over, for nothing is built from them."""

ORDER = (
    "model", "maker", "motor_type", "voltage", "voltage_min", "voltage_max", "stall_torque",
    "no_load_speed", "stall_current", "standby_current", "rated_torque", "mass", "gear_ratio",
    "armature", "armature_source", "winding_resistance", "torque_constant",
    "thermal_resistance_winding", "thermal_resistance_housing", "thermal_time_winding",
    "thermal_time_housing", "winding_temperature_max", "price", "currency", "source", "note",
    "uncertain",
)  # fmt: skip
"""Fields in the order in which files are written."""


class NumberCell(NamedTuple):
    """What a header of numbers stands for: a field and the factor to its unit."""

    field: str
    factor: float


def _header(field: str, unit: str) -> str:
    return f"{field}_{unit}" if unit else field


BY_HEADER = {
    _header(column.field, unit): NumberCell(column.field, factor)
    for column in NUMBERS
    for unit, factor in column.units.items()
}
"""Every header of numbers that is understood."""

HEADERS = {column.field: [_header(column.field, unit) for unit in column.units]
           for column in NUMBERS} | {name: [name] for name in TEXTS}  # fmt: skip
"""Headers by field; the first of each is how the package writes it."""
