"""Which motors carry a robot: walks with each motor's mass, inertia and torque-speed line."""

from hexapod_pin.study.selection.motor_study import default_study
from hexapod_pin.study.selection.selecting import load_motor_study, select_motors

__all__ = ["default_study", "load_motor_study", "select_motors"]
