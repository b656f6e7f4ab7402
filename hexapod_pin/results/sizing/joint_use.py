"""What each joint takes of its motor: torque, speed, heat, current, inertia."""

from __future__ import annotations

from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.sizing.gear_ratio import gear_numbers
from hexapod_pin.results.sizing.joint_demand import JointDemand
from hexapod_pin.results.sizing.motor_use import UNKNOWN, MotorUse
from hexapod_pin.results.sizing.motors import Motors
from hexapod_pin.results.sizing.winding import thermal_constant, winding_temperatures

Columns = dict[str, Array]


def joint_uses(
    demand: JointDemand, motors: Motors, lost_leg: bool, ambient: float
) -> tuple[MotorUse, ...]:
    """Return one row per joint; see `motor_budget`."""
    columns = {
        **line_numbers(demand, motors),
        **lasting_numbers(demand, motors),
        **gear_numbers(demand, motors),
        **current_numbers(demand, motors),
        "winding_temperature": winding_temperatures(demand, motors, ambient),
    }
    judged = ["peak_use", "continuous_use", "thermal_use", "holding_use", "speed_use"]
    judged += ["lost_leg_use"] if lost_leg else []
    return tuple(_row(demand, motors, columns, judged, j) for j in range(len(motors.records)))


def line_numbers(demand: JointDemand, motors: Motors) -> Columns:
    """Return the joints' place below the derated torque-speed line.

    Of samples, and at the largest torque of accepted steps with the speed sampled at that time.
    """
    size = np.abs(demand.torque)
    allowed = motors.allowed(demand.torque, demand.speed)
    top = motors.allowed(np.ones_like(demand.peak_torque), demand.peak_torque_speed)
    margin = np.minimum((allowed - size).min(axis=0), top - demand.peak_torque)
    use = np.maximum(share_used(size, allowed).max(axis=0), share_used(demand.peak_torque, top))
    return {
        "peak_use": use,
        "margin": margin,
        "outside_share": demand.weights @ (size > np.maximum(allowed, 0.0)),
        "speed_use": demand.peak_speed / (motors.derating.voltage * motors.no_load),
    }


def share_used(size: Array, allowed: Array) -> Array:
    """Return |torque| over what is allowed [-]; infinite where nothing is, 0 of no torque."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(allowed > 0.0, size / allowed, np.inf)
    return np.asarray(np.where(size > 0.0, share, 0.0))


def lasting_numbers(demand: JointDemand, motors: Motors) -> Columns:
    """Return torques that last over what is allowed for ever, and what a lost leg asks for."""
    moving = np.full(len(demand.kinds), np.nan)
    for constant in {thermal_constant(row) for row in motors.records} - {None}:
        own = [thermal_constant(row) == constant for row in motors.records]
        moving[own] = demand.thermal_rms(constant)[own]  # type: ignore[arg-type]
    at_stall = motors.allowed(np.ones_like(motors.stall), np.zeros_like(motors.stall))
    return {
        "continuous_use": demand.rms_torque / motors.continuous,
        "thermal_use": moving / motors.continuous,
        "holding_use": demand.holding / motors.continuous,
        "lost_leg_use": demand.holding_lost_leg / at_stall,
    }


def current_numbers(demand: JointDemand, motors: Motors) -> Columns:
    """Return the motors' own currents, from data-sheet currents [A]."""
    per_torque = motors.stall_current / motors.stall
    return {
        "current_peak": per_torque * demand.peak_torque,
        "current_rms": per_torque * demand.rms_torque,
    }


def _row(
    demand: JointDemand, motors: Motors, columns: Columns, judged: list[str], j: int
) -> MotorUse:  # fmt: skip
    numbers: dict[str, Any] = {
        name: None if np.isnan(values[j]) else float(values[j]) for name, values in columns.items()
    }
    words: dict[str, Any] = {"joint": demand.joint_names[j], "motor": motors.records[j].name}
    failures = {
        name: REASONS[name].format(**words, use=numbers[name], need=NEEDS[name](demand)[j])
        for name in judged
        if numbers[name] is not None and numbers[name] > 1.0
    }
    if numbers["peak_use"] == np.inf:
        failures["peak_use"] = BEYOND.format(**words)
    heat, hottest = numbers["winding_temperature"], motors.records[j].winding_temperature_max
    numbers["winding_temperature"] = UNKNOWN if heat is None else heat
    if heat is not None and hottest is not None and heat > hottest:
        failures["winding_temperature"] = HOT.format(**words, heat=heat, hottest=hottest)
    return MotorUse(kind=demand.kinds[j], **words, failures=failures, **numbers)


REASONS = {
    "peak_use": "{joint}: torque up to {need:.3g} N m is {use:.2f} of what {motor} gives at the "
    "speed of the same moment, derated",
    "continuous_use": "{joint}: RMS torque {need:.3g} N m is {use:.2f} of the continuous torque "
    "of {motor}",
    "thermal_use": "{joint}: the RMS torque over the winding's time constant is {use:.2f} of the "
    "continuous torque of {motor}",
    "holding_use": "{joint}: holding {need:.3g} N m at rest is {use:.2f} of the continuous torque "
    "of {motor}",
    "lost_leg_use": "{joint}: holding {need:.3g} N m with one leg lost is {use:.2f} of the derated "
    "stall torque of {motor}",
    "speed_use": "{joint}: speed up to {need:.3g} rad/s is {use:.2f} of the no-load speed of "
    "{motor} at the derated voltage",
}
BEYOND = (
    "{joint}: is to drive beyond the no-load speed of {motor} at the derated voltage, where it can "
    "only brake"
)
HOT = "{joint}: the winding of {motor} reaches {heat:.0f} deg C, {hottest:g} are allowed"
NEEDS = {
    "peak_use": lambda d: d.peak_torque,
    "continuous_use": lambda d: d.rms_torque,
    "thermal_use": lambda d: d.rms_torque,
    "holding_use": lambda d: d.holding,
    "lost_leg_use": lambda d: d.holding_lost_leg,
    "speed_use": lambda d: d.peak_speed,
}
