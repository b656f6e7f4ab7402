"""Drives without motors and dry friction, which is all that some equations have."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.robot.robot import Robot


def check_plain_drives(robot: Robot, servo: Servo, where: str) -> None:
    """Refuse motors and dry friction, for equations that do not have them.

    Raises:
        ParameterError: a joint has a motor or dry friction.
    """
    for name, motor, friction in zip(
        robot.joint_names, servo.motors(robot), robot.friction, strict=True
    ):
        if motor is not None:
            raise ParameterError(f"motor of joint {name}", motor, f"absent in {where}")
        if friction > 0.0:
            raise ParameterError(f"dry friction of joint {name}", friction, f"0 N m in {where}")
