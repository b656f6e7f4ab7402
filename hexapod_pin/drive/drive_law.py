"""Servo, motor, friction and stops of a robot's joints as one law."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hexapod_pin.arrays import Array
    from hexapod_pin.drive.gear_friction import GearFriction
    from hexapod_pin.drive.joint_stops import JointStops
    from hexapod_pin.drive.motor import Motor
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.native import DriveLaw
    from hexapod_pin.native import GearFriction as NativeGearFriction
    from hexapod_pin.robot.robot import Robot


def drive_law(robot: Robot, servo: Servo, stops: JointStops) -> DriveLaw:
    """Return the law of the drives of all joints; see docs/drive.md.

    Raises:
        ParameterError: gains or motors that do not fit the robot's joints.
    """
    from hexapod_pin import native

    kp, kd = servo.gains(robot)
    motors = servo.motors(robot)
    line, slope = np.full(len(motors), np.inf), np.zeros(len(motors))
    damping, friction = np.array(robot.damping), dry_friction(robot, servo)
    for j, motor in enumerate(motors):
        if motor is None:
            continue
        line[j] = motor.stall_torque * motor.voltage_ratio
        slope[j] = motor.stall_torque / motor.no_load_speed
        damping[j] += motor.viscous_friction
    return native.drive_law(
        kp=kp, kd=kd, cap=torque_cap(robot, servo), line_torque=line, line_slope=slope,
        damping=damping, friction=friction, lower=np.array(robot.lower, dtype=float),
        upper=np.array(robot.upper, dtype=float), stop_stiffness=stops.stiffnesses(robot),
        stop_dissipation=stops.dissipation, gear=gears(robot, motors),
    )  # fmt: skip


def check_gaps(robot: Robot, servo: Servo, stops: JointStops) -> None:
    """Refuse backlash behind a rotor without inertia, or without edges.

    Raises:
        ParameterError: names the joint.
    """
    if not robot.gaps:
        return
    motors, stiffness = servo.motors(robot), stops.stiffnesses(robot)
    for gap, joint in robot.gaps.items():
        motor = motors[robot.joint_index(joint)]
        if motor is None or not motor.armature > 0.0:
            hint = "Between motor and joint there is a gap: the rotor moves by itself."
            found = None if motor is None else motor.rotor_inertia
            raise ParameterError(f"Motor.rotor_inertia[{joint}]", found, "above 0 kg m^2", hint)
        if not stiffness[robot.joint_index(gap)] > 0.0:
            allowed = "above 0 N m/rad where gears have backlash"
            raise ParameterError("JointStops.gap_stiffness", stops.gap_stiffness, allowed)


def gears(robot: Robot, motors: Sequence[Motor | None]) -> list[NativeGearFriction]:
    """Return the gear friction of every joint in the core's form; none where no joint has any.

    A gear behind backlash is loaded by the edges of its gap alone: its load is what it passes on.
    """
    from hexapod_pin import native

    if not any(motor and motor.gear_friction for motor in motors):
        return []
    found = [
        native_gear(motor.gear_friction, motor.viscous_friction)
        if motor and motor.gear_friction
        else native.GearFriction()
        for motor in motors
    ]
    for joint in robot.gaps.values():
        found[robot.joint_index(joint)].external_load = False
    return found


def native_gear(gear: GearFriction, viscous: float) -> NativeGearFriction:
    """Return a gear's friction in the core's form, with its viscous friction [N m s/rad]."""
    from hexapod_pin import native

    found = native.GearFriction()
    for name in type(gear).model_fields:
        setattr(found, name, getattr(gear, name))
    found.viscous = viscous
    return found


def has_dry_friction(robot: Robot, servo: Servo) -> bool:
    """Return whether any joint has dry friction, of URDF, motor or gear."""
    gears = any(motor and motor.gear_friction for motor in servo.motors(robot))
    return bool(gears or dry_friction(robot, servo).any())


def dry_friction(robot: Robot, servo: Servo) -> Array:
    """Return the level of Coulomb friction of each joint, of URDF and motor (n,) [N m].

    The gear's friction, which depends on the load, is not in it.
    """
    own = [motor.dry_friction if motor else 0.0 for motor in servo.motors(robot)]
    level: Array = np.array(robot.friction) + own
    return level


def torque_cap(robot: Robot, servo: Servo) -> Array:
    """Return the largest torque of each joint at any speed (n,) [N m]; inf where there is none."""
    n = len(robot.joint_names)
    cap = np.array(robot.effort_limit, dtype=float) if servo.limited else np.full(n, np.inf)
    peaks = [motor.peak_torque if motor else None for motor in servo.motors(robot)]
    least: Array = np.minimum(cap, [np.inf if peak is None else peak for peak in peaks])
    return least


def torque_limit(robot: Robot, servo: Servo) -> Array:
    """Return the largest torque of each joint by effort, peak and stall torque (n,) [N m]."""
    stall = [m.stall_torque * m.voltage_ratio if m else np.inf for m in servo.motors(robot)]
    least: Array = np.minimum(np.minimum(torque_cap(robot, servo), robot.effort_limit), stall)
    return least


def followed_motors(robot: Robot, servo: Servo, *, current: bool, temperature: bool) -> Array:
    """Return `Motor.winding` of each joint, whose currents a run is to record (n, 7).

    No rows where nothing is to be recorded.

    Raises:
        ParameterError: no motor has the constants for what is to be recorded.
    """
    nothing = np.zeros((0, 7))
    if not (current or temperature):
        return nothing
    unknown = (np.nan,) * 7
    rows = np.array([m.winding if m else unknown for m in servo.motors(robot)]).reshape(-1, 7)
    for name, asked, known, needed in (
        ("current", current, ~np.isnan(rows[:, 0]), "torque_constant"),
        ("temperature", temperature, ~np.isnan(rows).any(axis=1),
         "torque_constant, winding_resistance, thermal_resistance_winding, "
         "thermal_resistance_housing, thermal_time_winding and thermal_time_housing"),
    ):  # fmt: skip
        if asked and not known.any():
            allowed = f"recorded of motors whose constants are known: Servo(motor=Motor({needed}))"
            raise ParameterError("record", name, allowed)
    return rows


def armature(robot: Robot, servo: Servo) -> Array:
    """Return what the rotors add to the joints' inertias (n,) [kg m^2]."""
    return np.array([motor.armature if motor else 0.0 for motor in servo.motors(robot)])
