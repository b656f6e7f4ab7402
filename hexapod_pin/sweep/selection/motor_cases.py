"""A case with motors: their masses at the joints, their rotors, and their torque-speed lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from hexapod_pin.drive.motor import Motor
from hexapod_pin.errors import ParameterError
from hexapod_pin.sweep.selection.motor_places import mass_loads

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.simulation.case import Case
    from hexapod_pin.simulation.mass_changes import MassLoad

Motors = Mapping[str, "MotorRecord"]
"""A motor for each kind of joint."""

RECORD = ("torque", "contacts")
"""What a budget of motors needs of a trace."""

NO_LINE = 1e6
"""Stall torque [N m] and no-load speed [rad/s] of a motor whose line is not to act."""


def with_motors(
    case: Case, motors: Motors, loads: tuple[MassLoad, ...], voltage: float, *, line: bool
) -> Case:
    """Return a case whose joints are driven by motors.

    The URDF's effort limits do not act: the motors take their place. Servo gains stay.

    Args:
        case: a walk.
        motors: of each kind of joint.
        loads: what the motors change of the robot's masses; see `motor_loads`.
        voltage: of the supply under load over that of the motors' data [-].
        line: whether torques are limited by the motors' lines; their rotors turn in any case.
    """
    scene = case.scene
    chosen = {kind: _motor(record, voltage, line) for kind, record in motors.items()}
    servo = scene.servos.model_copy(update={"motor": chosen, "limited": False})
    return replace(
        case, scene=replace(scene, servo=servo, loads=(*scene.loads, *loads)), record=RECORD
    )


def without_motors(case: Case) -> Case:
    """Return a case whose joints give any torque at any speed: what the walk asks for."""
    servo = case.scene.servos.model_copy(update={"motor": None, "limited": False})
    return replace(case, scene=replace(case.scene, servo=servo), record=RECORD)


def motor_loads(
    robot: Robot, motors: Motors, contained: float
) -> tuple[tuple[MassLoad, ...], tuple[str, ...]]:
    """Return what motors change of a robot's masses, and notes; see `mass_loads`.

    Raises:
        ParameterError: the mass of a motor is not known, or the file's links are lighter than the
            motors that they should contain.
    """
    for record in motors.values():
        if record.mass is None:
            raise ParameterError(f"{record.name}: mass", None, "known [kg]", "Give it in the file.")
    mass = {kind: float(record.mass or 0.0) for kind, record in motors.items()}
    return mass_loads(robot, mass, contained)


def _motor(record: MotorRecord, voltage: float, line: bool) -> Motor:
    motor = record.motor(voltage)
    if line:
        return motor
    free = {"stall_torque": NO_LINE, "no_load_speed": NO_LINE, "peak_torque": None}
    return motor.model_copy(update=free)
