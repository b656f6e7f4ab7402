"""Current, heat and electrical power of the joints' motors.

Where a servo was identified (`hp.drive.identified_drives`), the motor gives what its gear loses on
top of the joint's torque, and its current is that torque over the torque constant. Where torque
constant and winding resistance of the motor are published, its current follows from them, without
the gear's losses. Otherwise it is in proportion to the joint's torque, as the data sheet's stall
torque and stall current have it, and the gear's losses at stall stand for those at any load.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog.identified import IdentifiedDrive, identified_for
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motors import Motors


def identified_of(motors: Motors) -> dict[int, IdentifiedDrive]:
    """Return the identified servo of each joint that has one, by the joint's index."""
    found = ((j, identified_for(row)) for j, row in enumerate(motors.records))
    return {j: drive for j, drive in found if drive is not None}


def motor_torque(demand: JointDemand, motors: Motors) -> Array:
    """Return what the motors give, the losses of identified gears included (T, n) [N m].

    Of a joint at rest nothing is added: friction then helps to hold it, by an unknown part. Samples
    of a run whose motors had `gear_friction` contain it already (`JointDemand.geared`).
    """
    found: Array = demand.torque.copy()
    for j, drive in ({} if demand.geared else identified_of(motors)).items():
        if drive.model not in demand.geared_torque:
            demand.geared_torque[drive.model] = _with_losses(demand, drive)
        found[:, j] = demand.geared_torque[drive.model][:, j]
    return found


def _with_losses(demand: JointDemand, drive: IdentifiedDrive) -> Array:
    """Return what motors of one kind give at all joints (T, n) [N m]."""
    along, speed = np.sign(demand.speed), np.abs(demand.speed)
    friction = drive.gear.under_load(-along * demand.torque, speed, viscous=drive.viscous)
    return np.asarray(demand.torque + along * (friction + drive.viscous * speed))


class Electrical(NamedTuple):
    """Electrical constants of joints' motors, arrays (n,); NaN where a data sheet has no current.

    Attributes:
        per_torque: current over the motor's torque at the joint [A/(N m)].
        resistance: of the winding at 25 deg C [ohm].
        induced: voltage over the joint's speed [V s/rad].
    """

    per_torque: Array
    resistance: Array
    induced: Array


def electrical(motors: Motors) -> Electrical:
    """Return the constants of joints' motors: identified, published, or by the data sheet."""
    found = Electrical(
        motors.stall_current / motors.stall,
        np.array(motors.rated_voltage / motors.stall_current),
        motors.rated_voltage / motors.no_load,
    )
    for j, row in enumerate(motors.records):
        if row.torque_constant and row.winding_resistance and row.gear_ratio:
            at_joint = row.torque_constant * row.gear_ratio
            _put(found, j, at_joint, row.winding_resistance)
    for j, drive in identified_of(motors).items():
        _put(found, j, drive.torque_constant, drive.resistance)
    return found


def _put(found: Electrical, j: int, constant: float, ohm: float) -> None:
    found.per_torque[j], found.resistance[j], found.induced[j] = 1.0 / constant, ohm, constant


def current_per_torque(motors: Motors) -> Array:
    """Return the current over the motor's torque at the joint (n,) [A/(N m)]."""
    return electrical(motors).per_torque


def motor_current(demand: JointDemand, motors: Motors) -> Array:
    """Return the current of each motor, signed as its torque (T, n) [A]; NaN where unknown."""
    return np.asarray(current_per_torque(motors) * motor_torque(demand, motors))


def resistance(motors: Motors) -> Array:
    """Return R of each motor at 25 deg C (n,) [ohm]."""
    return electrical(motors).resistance


def current_numbers(demand: JointDemand, motors: Motors) -> dict[str, Array]:
    """Return peak and RMS current [A] and the winding's mean heat [W], named as in `MotorUse`.

    They are those of samples, times what the accepted steps' torque has over the samples'.
    """
    size = np.abs(demand.torque).max(axis=0)
    peak = np.abs(motor_current(demand, motors)).max(axis=0) * _over(demand.torque_peak, size)
    square = mean_square_current(demand, motors)
    heat = resistance(motors) * square
    return {"current_peak": peak, "current_rms": np.sqrt(square), "winding_heat": heat}


def mean_square_current(demand: JointDemand, motors: Motors) -> Array:
    """Return the mean square of each motor's current (n,) [A^2]; see `current_numbers`."""
    current, square = motor_current(demand, motors), demand.weights @ demand.torque**2
    more = _over(demand.torque_rms, np.sqrt(square))
    return np.asarray((demand.weights @ current**2) * more**2)


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
    current, constants = motor_current(demand, motors), electrical(motors)
    return np.asarray(current * (constants.resistance * current + constants.induced * demand.speed))
