"""Values computed once for each robot and dropped with it."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, TypeVar
from weakref import WeakKeyDictionary

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

Value = TypeVar("Value")


def once_per_robot(build: Callable[[Robot], Value]) -> Callable[[Robot], Value]:
    """Make a function of a robot compute its value once per robot.

    Robots are frozen and compared by identity, and are referred to weakly: the value must not hold
    the robot. An exception is not kept.
    """
    values: WeakKeyDictionary[Robot, Value] = WeakKeyDictionary()

    @wraps(build)
    def value_of(robot: Robot) -> Value:
        if robot not in values:
            values[robot] = build(robot)
        return values[robot]

    return value_of
