"""Temperature of a winding: two thermal bodies, and a resistance that grows with temperature.

    C_w T_w' = P - (T_w - T_h) / R_wh         P = i^2 R_25 (1 + 0.0039 (T_w - 25))
    C_h T_h' = (T_w - T_h) / R_wh - (T_h - T_a) / R_ha

w winding, h housing, a surroundings; C = time constant / resistance, as maxon's data sheets state
both. With a constant mean square of the current this is linear, and solved as such.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motors import Motors

COPPER = 0.0039
"""Rise of copper's resistance, over that at 25 deg C [1/K]."""

REFERENCE = 25.0
"""Temperature at which resistances are stated [deg C]."""


@dataclass(frozen=True)
class Winding:
    """Thermal constants of a motor, as data sheets state them.

    Attributes:
        resistance: of the winding at 25 deg C [ohm].
        to_housing: thermal resistance from winding to housing [K/W].
        to_ambient: from housing to surroundings [K/W].
        winding_time: time constant of the winding [s].
        housing_time: of the housing [s].
        copper: rise of the resistance [1/K].
    """

    resistance: float
    to_housing: float
    to_ambient: float
    winding_time: float
    housing_time: float
    copper: float = COPPER

    def course(self, mean_square: float, times: Array, ambient: float = 25.0) -> Array:
        """Return the winding's temperature after starting cold [deg C].

        Args:
            mean_square: of the current [A^2].
            times: since the start [s]. Shape (T,).
            ambient: temperature of the surroundings, and of the motor at first [deg C].

        Returns:
            Shape (T,).
        """
        system, source = self._system(mean_square, ambient)
        rates, shapes = np.linalg.eig(system)
        push = np.linalg.solve(shapes, source + system @ np.full(2, ambient))
        with np.errstate(over="ignore"):
            grown = [np.expm1(r * times) / r if r else times for r in rates]
        return np.asarray(ambient + np.real(shapes[0] @ (push[:, None] * np.array(grown))))

    def lasting(self, mean_square: float, ambient: float = 25.0) -> float:
        """Return the winding's temperature in the end [deg C]; infinite where it runs away."""
        cold = mean_square * self.resistance * (self.to_housing + self.to_ambient)
        growth = 1.0 - self.copper * cold
        if growth <= 0.0:
            return float("inf")
        return ambient + cold * (1.0 + self.copper * (ambient - REFERENCE)) / growth

    def hottest(self, mean_square: float, moving_square: float, ambient: float = 25.0) -> float:
        """Return the largest temperature in a lasting, repeating load [deg C].

        The housing sees the mean; the winding's own rise above it follows the load.

        Args:
            mean_square: of the current [A^2].
            moving_square: its largest mean square behind a lag of `winding_time` [A^2].
            ambient: temperature of the surroundings [deg C].
        """
        lasting = self.lasting(mean_square, ambient)
        loss = self.resistance * (1.0 + self.copper * (lasting - REFERENCE))
        return lasting + self.to_housing * loss * (moving_square - mean_square)

    def _system(self, mean_square: float, ambient: float) -> tuple[Array, Array]:
        """Return the matrix and the source of d/dt (T_w, T_h) [1/s, K/s]."""
        loss = mean_square * self.resistance
        winding, housing = self.winding_time / self.to_housing, self.housing_time / self.to_ambient
        system = np.array(
            [
                [(self.copper * loss - 1.0 / self.to_housing) / winding, 1.0 / self.winding_time],
                [1.0 / (self.to_housing * housing), 0.0],
            ]
        )
        system[1, 1] = -(1.0 / self.to_housing + 1.0 / self.to_ambient) / housing
        source = np.array(
            [loss * (1.0 - self.copper * REFERENCE) / winding, ambient / self.housing_time]
        )
        return system, source


def winding_temperatures(demand: JointDemand, motors: Motors, ambient: float) -> Array:
    """Return the hottest winding temperature in lasting walking (n,) [deg C]; NaN where unknown.

    The current is the joint's torque through the gear, without the gear's losses, over the
    torque constant of the motor itself: a low estimate.
    """
    found = np.full(len(motors.records), np.nan)
    for j, row in enumerate(motors.records):
        winding, constant = winding_of(row), row.torque_constant
        if winding is None or constant is None or row.gear_ratio is None:
            continue
        per_torque = 1.0 / (constant * row.gear_ratio)
        moving = demand.thermal_rms(winding.winding_time)[j]
        squares = (per_torque * demand.torque_rms[j]) ** 2, (per_torque * moving) ** 2
        found[j] = winding.hottest(*squares, ambient)
    return found


def winding_of(row: MotorRecord) -> Winding | None:
    """Return the thermal constants of a row of the catalogue; None where one is missing."""
    found = (
        row.winding_resistance, row.thermal_resistance_winding, row.thermal_resistance_housing,
        row.thermal_time_winding, row.thermal_time_housing,
    )  # fmt: skip
    known = [value for value in found if value is not None]
    return Winding(*known) if len(known) == len(found) else None


def thermal_constant(row: MotorRecord) -> float | None:
    """Return the time constant over which heat counts [s]: the winding's, else the housing's."""
    return row.thermal_time_winding or row.thermal_time_housing
