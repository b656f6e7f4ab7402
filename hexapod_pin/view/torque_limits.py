"""What the torques of a run are held against: a motor's line, or the joints' limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.drive.motor import Motor
from hexapod_pin.results.trace import Trace


@dataclass(frozen=True)
class Limits:
    """What torques are held against: a torque that falls with speed, or is constant.

    Attributes:
        name: in words, such as "AX-12A, derated".
        stall: of every joint at rest [N m]; infinite where there is none. Shape (n,).
        slope: loss of torque with speed in the torque's direction [N m s/rad]. Shape (n,).
        per_torque: current of a motor over its torque [A/(N m)]; None where it is not known.
    """

    name: str
    stall: Array
    slope: Array
    per_torque: float | None = None

    def use(self, torque: Array, speed: Array) -> Array:
        """Return |torque| over what is allowed [-], as `MotorUse.peak_use`; shape (T, n)."""
        allowed = self.stall - self.slope * np.sign(torque) * speed
        size = np.abs(torque)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(allowed > 0.0, size / allowed, np.inf)
        return np.where(size > 0.0, share, 0.0)


def limits_of(trace: Trace, record: MotorRecord | None, derating: Derating | None = None) -> Limits:
    """Return the derated line of a motor thought of, else of the run's own motor, else limits.

    Args:
        trace: of the run.
        record: a row of the catalogue; None: the run's motor, or its joints' torque limits.
        derating: what of `record` may be used; None: the defaults.
    """
    count = len(trace.joint_names)
    scene = trace.run.scene
    if record is not None and record.no_load_speed is not None:
        share = derating or Derating()
        stall = share.peak * share.voltage * record.stall_torque
        slope = share.peak * record.stall_torque / record.no_load_speed
        current = record.stall_current
        per_torque = None if current is None else current / record.stall_torque
        name = f"{record.name}, derated ({share.peak:g} of its line, {share.voltage:g} U)"
        return Limits(name, np.full(count, stall), np.full(count, slope), per_torque)
    motor = None if scene is None else scene.servo.motor
    if isinstance(motor, Motor):
        slope = motor.stall_torque / motor.no_load_speed
        top = motor.stall_torque * motor.voltage_ratio
        return Limits("the motor's line, as simulated", np.full(count, top), np.full(count, slope))
    return Limits("torque limit", trace.run.robot.effort(count), np.zeros(count))
