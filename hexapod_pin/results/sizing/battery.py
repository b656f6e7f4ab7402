"""All joints together load the battery, and its voltage falls with their current."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_current import current_per_torque, electrical_power
from hexapod_pin.results.sizing.motors import Motors


@dataclass(frozen=True)
class BatteryLoad(Immutable):
    """What all joints together draw at the same time, an estimate.

    Each motor takes R i^2 + i k w (`motor_current`): of identified servos with the losses of their
    gears, else from the data sheet's currents. Without regeneration, what a joint's motor would
    give back is lost in its drive. Standby currents are added, *assumed* ones where a maker
    publishes none. All None where a data sheet has no current.

    A pack with an internal resistance r gives less voltage the more is drawn: U = U0 - r I with the
    sum I of all currents, at every sample; the motors' lines fall with it.

    Attributes:
        voltage: of the supply under load, without the pack's resistance [V].
        current_peak: largest sum of all joints, without regeneration [A].
        current_mean: [A].
        current_rms: [A].
        power_peak: largest sum without regeneration [W].
        power_mean: without regeneration [W].
        power_mean_regeneration: what is given back counts [W].
        energy: per cycle (or window) without regeneration [J].
        energy_regeneration: the same where what is given back counts [J].
        cost_of_transport: energy / (m g d) without regeneration [-]; None without a distance.
        cost_of_transport_regeneration: the same with it [-].
        sum_of_peaks: of the joints' own largest currents, for comparison [A].
        unknown: why there are no numbers; empty where there are.
        pack_resistance: internal resistance of the battery [ohm].
        voltage_least: lowest voltage at the motors [V].
        voltage_mean: their mean voltage [V].
        overloaded_share: share of the time in which the pack cannot give that power at any voltage
            [-]; its voltage is then taken as half of the idle one, where it gives most.
    """

    voltage: float | None = None
    current_peak: float | None = None
    current_mean: float | None = None
    current_rms: float | None = None
    power_peak: float | None = None
    power_mean: float | None = None
    power_mean_regeneration: float | None = None
    energy: float | None = None
    energy_regeneration: float | None = None
    cost_of_transport: float | None = None
    cost_of_transport_regeneration: float | None = None
    sum_of_peaks: float | None = None
    unknown: str = ""
    pack_resistance: float = 0.0
    voltage_least: float | None = None
    voltage_mean: float | None = None
    overloaded_share: float | None = None

    @property
    def sag_line(self) -> str:
        """How far a pack with an internal resistance sags, in one line; empty without one."""
        if not self.pack_resistance or self.voltage_least is None:
            return ""
        line = (
            f"battery: {self.voltage_least:.3g} V at least of {self.voltage:.3g} V, "
            f"{self.current_peak:.3g} A through {self.pack_resistance:g} ohm"
        )
        return f"{line}: more than it can give" if self.overloaded_share else line

    def run_time(self, energy: float) -> float | None:
        """Return how long a battery lasts, nothing given back [s]; None where that is unknown.

        Args:
            energy: that the battery can give [J], such as 0.8 of its capacity; of 1 Wh 3600 J.
        """
        return energy / self.power_mean if self.power_mean else None


class Supply(NamedTuple):
    """The battery at the samples of a demand, (T,) each.

    Attributes:
        voltage: at the motors [V].
        current: of all motors and their electronics, without regeneration [A].
        overloaded: whether the pack cannot give the power.
    """

    voltage: Array
    current: Array
    overloaded: Array


def supply_of(demand: JointDemand, motors: Motors, pack_resistance: float = 0.0) -> Supply | None:
    """Return voltage and current of the battery; None where they are not known.

    The motors take the power P that torque and speed need, whatever the voltage, so that with the
    standby current s the voltage is the larger root of U^2 - (U0 - r s) U + r P = 0.

    Args:
        demand: what the joints need.
        motors: of the joints.
        pack_resistance: r, of the battery and its leads [ohm].
    """
    if _unknown(motors):
        return None
    taken = np.maximum(electrical_power(demand, motors), 0.0).sum(axis=1)
    standby = float(motors.standby_current.sum())
    idle = float(motors.derating.voltage * motors.rated_voltage[0]) - pack_resistance * standby
    inside = idle**2 - 4.0 * pack_resistance * taken
    voltage = 0.5 * (idle + np.sqrt(np.maximum(inside, 0.0)))
    return Supply(voltage, taken / voltage + standby, inside < 0.0)


def battery_load(demand: JointDemand, motors: Motors, pack_resistance: float = 0.0) -> BatteryLoad:
    """Return currents, powers and energies of all joints, from samples."""
    found = supply_of(demand, motors, pack_resistance)
    if found is None:
        return BatteryLoad(unknown=_unknown(motors))
    supply = float(motors.derating.voltage * motors.rated_voltage[0])
    power, weights = electrical_power(demand, motors), demand.weights
    idle = supply * float(motors.standby_current.sum())
    drawn, net = supply * found.current, power.sum(axis=1) + idle
    if pack_resistance:
        net = net + pack_resistance * found.current**2
    mean, mean_net = float(weights @ drawn), float(weights @ net)
    return BatteryLoad(
        voltage=supply,
        current_peak=float(found.current.max()),
        current_mean=float(weights @ found.current),
        current_rms=float(np.sqrt(weights @ found.current**2)),
        power_peak=float(drawn.max()),
        power_mean=mean,
        power_mean_regeneration=mean_net,
        energy=mean * demand.duration,
        energy_regeneration=mean_net * demand.duration,
        cost_of_transport=demand.per_way(mean * demand.duration),
        cost_of_transport_regeneration=demand.per_way(mean_net * demand.duration),
        sum_of_peaks=float(np.maximum(power, 0.0).max(axis=0).sum() + idle) / supply,
        pack_resistance=pack_resistance,
        voltage_least=float(found.voltage.min()),
        voltage_mean=float(weights @ found.voltage),
        overloaded_share=float(weights @ found.overloaded),
    )


def battery_current(demand: JointDemand, motors: Motors) -> Array:
    """Return what all joints together draw without regeneration, of samples (T,) [A].

    NaN where a data sheet has no current, or motors of several voltages have no common battery.
    """
    found = supply_of(demand, motors)
    return np.full(len(demand.time), np.nan) if found is None else found.current


def _unknown(motors: Motors) -> str:
    """Return why nothing can be computed, if so."""
    known = current_per_torque(motors)
    missing = {r.name for j, r in enumerate(motors.records) if np.isnan(known[j])}
    if missing:
        return f"no stall current is published of {', '.join(sorted(missing))}"
    voltages = sorted({row.voltage for row in motors.records})
    if len(voltages) > 1:
        return f"motors of {' and '.join(f'{v:g} V' for v in voltages)}: no common battery"
    return ""
