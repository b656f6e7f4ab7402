"""Working memory of Pinocchio for a robot, one per thread: making it costs more than using it."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from hexapod_pin.robot.once_per_robot import once_per_robot

if TYPE_CHECKING:
    import pinocchio as pin

    from hexapod_pin.robot.robot import Robot


class _ThreadData(threading.local):
    """The pin.Data of the running thread."""

    data: pin.Data | None = None


@once_per_robot
def _thread_data(robot: Robot) -> _ThreadData:
    return _ThreadData()


def scratch_data(robot: Robot) -> pin.Data:
    """Return a pin.Data of the robot's model; its content lasts until the thread's next use."""
    local = _thread_data(robot)
    if local.data is None:
        local.data = robot.model.createData()
    return local.data
