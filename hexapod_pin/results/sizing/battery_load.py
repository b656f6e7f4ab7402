"""What all joints together draw from the battery at the same time: see `BatteryLoad`."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.sizing.joint_demand import JointDemand
from hexapod_pin.results.sizing.motor_use import BatteryLoad
from hexapod_pin.results.sizing.motors import Motors


def battery_load(demand: JointDemand, motors: Motors) -> BatteryLoad:
    """Return currents, powers and energies of all joints, from samples."""
    if reason := _unknown(motors):
        return BatteryLoad(unknown=reason)
    supply = float(motors.derating.voltage * motors.rated_voltage[0])
    power, weights = electrical_power(demand, motors), demand.weights
    standby = supply * float(np.nansum(motors.standby_current))
    taken = np.maximum(power, 0.0)
    drawn, net = supply * battery_current(demand, motors), power.sum(axis=1) + standby
    mean, mean_net = float(weights @ drawn), float(weights @ net)
    return BatteryLoad(
        voltage=supply,
        peak_current=float(drawn.max()) / supply,
        mean_current=mean / supply,
        rms_current=float(np.sqrt(weights @ drawn**2)) / supply,
        peak_power=float(drawn.max()),
        mean_power=mean,
        mean_power_regeneration=mean_net,
        energy=mean * demand.duration,
        energy_regeneration=mean_net * demand.duration,
        cost_of_transport=demand.per_way(mean * demand.duration),
        cost_of_transport_regeneration=demand.per_way(mean_net * demand.duration),
        sum_of_peaks=float(taken.max(axis=0).sum() + standby) / supply,
    )


def battery_current(demand: JointDemand, motors: Motors) -> Array:
    """Return what all joints together draw without regeneration, of samples (T,) [A].

    NaN where a data sheet has no current, or motors of several voltages have no common battery.
    """
    if _unknown(motors):
        return np.full(len(demand.time), np.nan)
    supply = float(motors.derating.voltage * motors.rated_voltage[0])
    taken = np.maximum(electrical_power(demand, motors), 0.0)
    return np.asarray(taken.sum(axis=1) / supply + np.nansum(motors.standby_current))


def electrical_power(demand: JointDemand, motors: Motors) -> Array:
    """Return V d i of each joint's motor (T, n) [W]: winding losses and mechanical power.

    d i = (tau / T0 + w / w0) I0 tau / T0. It follows from the same straight lines of torque and
    current over speed as the data sheet's three numbers; < 0 where the motor gives power back.
    """
    share = demand.torque / motors.stall
    duty = share + demand.speed / motors.no_load
    return np.asarray(motors.rated_voltage * motors.stall_current * duty * share)


def _unknown(motors: Motors) -> str:
    """Say why nothing can be told, if so."""
    missing = {r.name for r in motors.records if r.stall_current is None}
    if missing:
        return f"no stall current is published of {', '.join(sorted(missing))}"
    voltages = sorted({row.voltage for row in motors.records})
    if len(voltages) > 1:
        return f"motors of {' and '.join(f'{v:g} V' for v in voltages)}: no common battery"
    return ""
