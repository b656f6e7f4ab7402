"""The plan that foot control starts from: a walk's feet as a table for the native core."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.control.six_legs import six_legs
from hexapod_pin.robot.once_per_robot import once_per_robot

if TYPE_CHECKING:
    from hexapod_pin.native import WalkTable
    from hexapod_pin.robot.robot import Robot

ROWS_PER_CYCLE = 512
"""Rows of a cycle: cubics between them are off by 1e-6 m at most, on arcs by 2e-6 m."""

KEPT_POSTURES = 64
"""Of how many walks of a robot the first posture is remembered."""

CYCLES_AT_ONCE = 16
"""By which the table of a walk that does not repeat grows."""


class PlannedWalk:
    """Feet, speed and schedule of a walk at any time.

    Attributes:
        table: for the core.
    """

    def __init__(self, robot: Robot, control: Any) -> None:
        """Tabulate a walk.

        Args:
            robot: whose walk it is.
            control: has `path(robot)`, a `gait`, and `plan(robot, duration)`, which refuses what
                cannot be walked. A walk that follows a velocity command is not tried beforehand.

        Raises:
            GaitError: the robot cannot walk it.
        """
        from hexapod_pin.native import WalkTable

        self._path = control.path(robot)
        gait = self._path.gait
        if self._path.periodic:
            control.plan(robot, gait.cycle_time)
        self._cycle = gait.cycle_time
        self._spacing = self._cycle / ROWS_PER_CYCLE
        self.repeats = bool(self._path.periodic and getattr(control, "stop_at", None) is None)
        steady = self._cycle * np.ceil(self._path.steady_from / self._cycle - 1e-9)
        self.table: WalkTable = WalkTable(
            list(gait.phases), gait.duty, self._cycle, self._spacing,
            steady if self.repeats else -1.0,
        )  # fmt: skip
        self._rows = 0
        self._grow(round(steady / self._cycle) + 1)

    def reach(self, time: float) -> None:
        """See to it that the table covers a time [s], and the swing after it."""
        while not self.repeats and time + 2.0 * self._cycle > self.table.end:
            self._grow(CYCLES_AT_ONCE)

    def _grow(self, cycles: int) -> None:
        """Append cycles to the table."""
        count = cycles * ROWS_PER_CYCLE + (2 if self._rows == 0 else 0)
        time = self._spacing * np.arange(self._rows, self._rows + count)
        feet, velocity = self._path.positions_and_velocities(time)
        self.table.append(
            np.ascontiguousarray(feet),
            np.ascontiguousarray(velocity),
            np.ascontiguousarray(self._path.stance(time)),
            np.ascontiguousarray(self._path.body.pose_and_twist(time)[1]),
        )
        self._rows += count


@once_per_robot
def _postures(robot: Robot) -> OrderedDict[Any, Array]:
    """Return the first postures of walks."""
    return OrderedDict()


def first_posture(robot: Robot, control: Any) -> Array:
    """Return the joint angles of a walk's beginning, found once for equal walks [rad]. (n,)."""
    known = _postures(robot)
    if control not in known:
        feet = control.path(robot).positions(np.zeros(1))
        known[control] = read_only(six_legs(robot).joint_angles(feet)[0])
        while len(known) > KEPT_POSTURES:
            known.popitem(last=False)
    return known[control]
