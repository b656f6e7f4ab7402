"""What the torques of a run are held against: motors' lines, or the joints' limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.identified import identified_drives
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.drive.motor import Motor
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_current import motor_current
from hexapod_pin.results.sizing.motors import Motors
from hexapod_pin.results.trace import Trace


@dataclass(frozen=True)
class Limits:
    """What torques are held against: a torque that falls with speed, or is constant.

    Attributes:
        name: in words, such as "AX-12A, derated".
        stall: of every joint at rest [N m]; infinite where there is none. Shape (n,).
        slope: loss of torque with speed in the torque's direction [N m s/rad]. Shape (n,).
        cap: largest torque at any speed [N m]; infinite where there is none. Shape (n,).
        per_torque: current over torque [A/(N m)]; NaN where it is not known. Shape (n,).
    """

    name: str
    stall: Array
    slope: Array
    cap: Array
    per_torque: Array

    @property
    def at_rest(self) -> Array:
        """What is allowed of every joint at rest [N m]. Shape (n,)."""
        return np.minimum(self.stall, self.cap)

    def use(self, torque: Array, speed: Array) -> Array:
        """Return |torque| over what is allowed [-], as `MotorUse.peak_use`; shape (T, n)."""
        stall = np.where(np.isinf(self.stall), self.cap, self.stall)
        allowed = np.minimum(stall - self.slope * np.sign(torque) * speed, self.cap)
        size = np.abs(torque)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(allowed > 0.0, size / allowed, np.inf)
        return np.where(size > 0.0, share, 0.0)


def limits_of(trace: Trace, record: MotorRecord | None, derating: Derating | None = None) -> Limits:
    """Return the derated line of a motor thought of, else of the run's own motors, else limits.

    Args:
        trace: of the run.
        record: a row of the catalogue; None: the run's motors, or its joints' torque limits.
        derating: what of `record` may be used; None: the defaults.
    """
    count = len(trace.joint_names)
    if record is not None and record.no_load_speed is not None:
        share = derating or Derating()
        stall = share.peak * share.voltage * record.stall_torque
        slope = share.peak * record.stall_torque / record.no_load_speed
        current = record.stall_current
        per_torque = np.nan if current is None else current / record.stall_torque
        name = f"{record.name}, derated ({share.peak:g} of its line, {share.voltage:g} U)"
        full = (np.full(count, value) for value in (stall, slope, np.inf, per_torque))
        return Limits(name, *full)
    return _as_simulated(trace)


def _as_simulated(trace: Trace) -> Limits:
    """Return the limits that acted in the run: lines of its motors, and what caps them."""
    servo = None if trace.run.scene is None else trace.run.scene.servo
    count = len(trace.joint_names)
    cap = trace.run.robot.effort(count).copy()
    if servo is not None and servo.motor is not None and not servo.limited:
        cap = np.full(count, np.inf)
    stall, slope, per_torque = np.full(count, np.inf), np.zeros(count), np.full(count, np.nan)
    motors = motors_of(trace)
    for j, motor in enumerate(motors):
        if motor is None:
            continue
        stall[j] = motor.stall_torque * motor.voltage_ratio
        slope[j] = motor.stall_torque / motor.no_load_speed
        cap[j] = min(cap[j], np.inf if motor.peak_torque is None else motor.peak_torque)
        if motor.torque_constant is not None:
            per_torque[j] = 1.0 / (motor.torque_constant * motor.gear_ratio)
    name = "the motor's line, as simulated" if any(motors) else "torque limit"
    return Limits(name, stall, slope, cap, per_torque)


def motors_of(trace: Trace) -> tuple[Motor | None, ...]:
    """Return the motor of each joint of a run, by its name, else its kind; None where none is."""
    servo = None if trace.run.scene is None else trace.run.scene.servo
    motor = None if servo is None else servo.motor
    if not isinstance(motor, Mapping):
        return (motor,) * len(trace.joint_names)
    known = trace.run.robot.joint_kinds
    kinds = joint_kinds(trace.joint_names, len(trace.foot_names), known)
    pairs = zip(trace.joint_names, kinds, strict=True)
    return tuple(motor.get(name, motor.get(kind)) for name, kind in pairs)


def current_of(trace: Trace, record: MotorRecord | None) -> Array | None:
    """Return the currents of a servo that was identified, losses of its gear included (T, n) [A].

    None of another, whose current is in proportion to the torque, and without torques.
    """
    if record is None or record.no_load_speed is None or "torque" not in trace.recorded:
        return None
    if record.model not in identified_drives() or len(trace.time) < 2:
        return None
    kinds = joint_kinds(trace.joint_names, len(trace.foot_names), trace.run.robot.joint_kinds)
    motors = Motors.of(kinds, record, Derating())
    demand = JointDemand.of_samples(
        trace.time, trace.torque, trace.v[:, 6:], joint_names=trace.joint_names, joint_kinds=kinds,
        geared=any(one is not None and one.gear_friction is not None for one in motors_of(trace)),
    )  # fmt: skip
    return motor_current(demand, motors)
