"""Gaits by name for a robot with any number of legs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hexapod_pin.control.gait import Gait, gaits_for
from hexapod_pin.control.six_legs import six_legs

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

PREFERRED = ("tetrapod", "wave")
"""The first of these that a robot's legs can walk is its default."""


def default_gait(robot: Robot) -> str:
    """Return the name of the gait that a robot walks where none is asked for.

    "tetrapod" with six legs ([S2]'s) and with eight; "wave" with four, five or seven.

    Raises:
        GaitError: the robot has no legs that a gait can move.
    """
    fitting = gaits_for(len(six_legs(robot).legs))
    return next(name for name in PREFERRED if name in fitting)


def named_gait(robot: Robot, name: str, **fields: float) -> Gait:
    """Return a gait of `GAITS` for a robot's number of legs.

    Args:
        robot: whose legs walk.
        name: of the gait.
        fields: stroke, cycle_time, duty (wave), lift, heading, turn_rate.

    Raises:
        UnknownNameError: no gait of that name fits so many legs; lists those that do.
        GaitError: the robot has no legs that a gait can move.
        ParameterError: a value is out of range.
    """
    values: dict[str, Any] = fields
    return Gait.by_name(name, legs=len(six_legs(robot).legs), **values)
