"""Current, heat and electrical power of the joints' motors.

Where a servo was identified (`hp.drive.identified_drives`), the motor gives what its gear loses on
top of the joint's torque, and its current is that torque over the torque constant. Otherwise the
current is in proportion to the joint's torque, as the data sheet's stall torque and stall current
have it, and the gear's losses at stall stand for those at any load.
"""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog.identified import IdentifiedDrive, identified_drives
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motors import Motors


def identified_of(motors: Motors) -> dict[int, IdentifiedDrive]:
    """Return the identified servo of each joint that has one, by the joint's index."""
    known = identified_drives()
    models = enumerate(row.model for row in motors.records)
    return {j: known[model] for j, model in models if model in known}


def motor_torque(demand: JointDemand, motors: Motors) -> Array:
    """Return what the motors give, the losses of identified gears included (T, n) [N m].

    Of a joint at rest nothing is added: friction then helps to hold it, by an unknown part. Samples
    of a run whose motors had `gear_friction` contain it already (`JointDemand.geared`).
    """
    found: Array = demand.torque.copy()
    for j, drive in ({} if demand.geared else identified_of(motors)).items():
        along = np.sign(demand.speed[:, j])
        speed = np.abs(demand.speed[:, j])
        load = -along * demand.torque[:, j]
        friction = drive.gear.under_load(load, speed, viscous=drive.viscous)
        found[:, j] += along * (friction + drive.viscous * speed)
    return found


def motor_current(demand: JointDemand, motors: Motors) -> Array:
    """Return the current of each motor, signed as its torque (T, n) [A]; NaN where unknown."""
    per_torque = motors.stall_current / motors.stall
    for j, drive in identified_of(motors).items():
        per_torque[j] = 1.0 / drive.torque_constant
    return np.asarray(per_torque * motor_torque(demand, motors))


def resistance(motors: Motors) -> Array:
    """Return R of each motor, identified or rated voltage over stall current (n,) [ohm]."""
    found = np.array(motors.rated_voltage / motors.stall_current)
    for j, drive in identified_of(motors).items():
        found[j] = drive.resistance
    return found


def current_numbers(demand: JointDemand, motors: Motors) -> dict[str, Array]:
    """Return peak and RMS current [A] and the winding's mean heat [W], named as in `MotorUse`.

    They are those of samples, times what the accepted steps' torque has over the samples'.
    """
    current = motor_current(demand, motors)
    size, square = np.abs(demand.torque).max(axis=0), demand.weights @ demand.torque**2
    peak = np.abs(current).max(axis=0) * _over(demand.torque_peak, size)
    rms = np.sqrt(demand.weights @ current**2) * _over(demand.torque_rms, np.sqrt(square))
    heat = resistance(motors) * rms**2
    return {"current_peak": peak, "current_rms": rms, "winding_heat": heat}


def _over(steps: Array, samples: Array) -> Array:
    """Return the ratio of two torques of each joint, 1 where the joint has none."""
    found: Array = np.divide(steps, samples, out=np.ones_like(samples), where=samples > 0.0)
    return found


def electrical_power(demand: JointDemand, motors: Motors) -> Array:
    """Return R i^2 + i k w of each joint's motor (T, n) [W]: its winding's heat and its work.

    With a data sheet's numbers that is V d i, d = tau / T0 + w / w0 the duty and i = I0 tau / T0:
    both follow from the same straight lines of torque and current over speed. < 0 where the motor
    gives power back.
    """
    current = motor_current(demand, motors)
    induced = motors.rated_voltage / motors.no_load
    for j, drive in identified_of(motors).items():
        induced[j] = drive.torque_constant
    return np.asarray(current * (resistance(motors) * current + induced * demand.speed))
