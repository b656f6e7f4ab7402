"""The six legs of a walking robot, in gait order, with what a plan needs of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.control.gait import LEG_ORDER
from hexapod_pin.errors import GaitError
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.leg_set import LegSet
from hexapod_pin.robot.once_per_robot import once_per_robot

if TYPE_CHECKING:
    from hexapod_pin.control.foot_path import FootPath
    from hexapod_pin.robot.robot import Robot


@dataclass(frozen=True, eq=False)
class SixLegs:
    """Six legs in gait order; one instance per robot, compared by identity.

    Attributes:
        kinematics: the legs with stacked geometry.
        radius: of each foot sphere [m]. Shape (6,).
        soles: lowest point of each foot in the standing posture, base frame [m]. Shape (6,).
        max_rate: joint velocity limits [rad/s]. Shape (6, 3).
        joint_index: place of each leg's joints in `Robot.joint_names`. Shape (6, 3).
        posture: standing angles of all joints of the robot [rad]. Shape (n,).
    """

    kinematics: LegSet
    radius: Array
    soles: Array
    max_rate: Array
    joint_index: NDArray[np.intp]
    posture: Array

    @property
    def legs(self) -> tuple[LegKinematics, ...]:
        """The legs one by one."""
        return self.kinematics.legs

    @property
    def neutral_feet(self) -> Array:
        """Foot centres of the standing posture, base frame [m]. Shape (6, 3)."""
        return self.kinematics.neutral_feet

    def foot_motion(self, path: FootPath, time: Array) -> tuple[Array, Array]:
        """Return foot positions [m] and velocities [m/s] leg by leg, base frame. (6, K, 3) each."""
        p_BF, v_BF = path.positions_and_velocities(time)
        first, second = (np.ascontiguousarray(np.swapaxes(x, 0, 1)) for x in (p_BF, v_BF))
        return first, second

    def joint_rows(self, values: Array, others: ArrayLike) -> Array:
        """Return values of the legs' joints (6, K, 3) with a row per time, `joint_names` order.

        Args:
            values: of the legs' joints. Shape (6, K, 3).
            others: of the joints that belong to no leg; the entries of the legs' are not used.
                A number or shape (n,).

        Returns:
            Shape (K, n).
        """
        rows = np.empty((values.shape[1], len(self.posture)))
        rows[:] = others
        rows[:, self.joint_index.ravel()] = np.swapaxes(values, 0, 1).reshape(len(rows), -1)
        return rows

    @cached_property
    def _solve_rows(self) -> Callable[[Array, Array], bool] | None:
        form = self.kinematics.closed_form
        return None if form is None else form.row_solver(self.joint_index)

    def joint_angles(self, feet: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Return the joint angles that put the feet at given places: inverse kinematics.

        Args:
            feet: centres of the feet, base frame, legs in gait order [m]. Shape (B, 6, 3).
            near: angles to be nearest to, by whole turns, and those of the joints that belong to
                no leg; the standing posture if None [rad]. Shape (B, n).

        Returns:
            `Robot.joint_names` order [rad]. Shape (B, n).

        Raises:
            ReachError: of the first leg that cannot reach a place inside its joint limits.
        """
        p_BF = np.ascontiguousarray(feet, dtype=float)
        begin = np.tile(self.posture, (len(p_BF), 1)) if near is None else near
        rows = np.array(begin, dtype=float, order="C")
        if self._solve_rows is not None and self._solve_rows(p_BF, rows):
            return rows
        return self._joint_angles(p_BF, np.array(begin, dtype=float))

    def _joint_angles(self, feet: Array, rows: Array) -> Array:
        """Return the same for legs of any shape, or raise what says why a leg cannot."""
        p_BF = np.ascontiguousarray(np.swapaxes(feet, 0, 1))
        start = np.swapaxes(rows[:, self.joint_index], 0, 1)
        return self.joint_rows(self.kinematics.inverse_each(p_BF, start), rows)

    def leg_rows(self, row: Array) -> Array:
        """Return a row (n,) of joint values leg by leg. Shape (6, 3)."""
        legs: Array = row[self.joint_index]
        return legs


@once_per_robot
def six_legs(robot: Robot) -> SixLegs:
    """Return the six legs of a robot in gait order.

    Raises:
        GaitError: the robot does not have six legs.
    """
    names = [leg.name for leg in robot.legs]
    if sorted(names) != sorted(LEG_ORDER):
        raise GaitError(
            f"robot {robot.name} has {len(names)} legs that a gait can move "
            f"({', '.join(names) or 'none'}); a gait needs the six legs {', '.join(LEG_ORDER)}.",
            "legs",
            None,
        )
    legs = [LegKinematics.of(robot, name) for name in LEG_ORDER]
    index = np.array([[robot.joint_index(joint) for joint in leg.joints] for leg in legs])
    radius = np.array([robot.foot(robot.leg(leg.name).foot).radius for leg in legs])
    kinematics = LegSet.of(legs)
    return SixLegs(
        kinematics=kinematics,
        radius=read_only(radius),
        soles=read_only(kinematics.neutral_feet[:, 2] - radius),
        max_rate=read_only(robot.velocity[index]),
        joint_index=index,
        posture=read_only(robot.posture),
    )


def walking_legs(robot: Robot) -> list[LegKinematics]:
    """Return the six legs in gait order, one by one.

    Raises:
        GaitError: the robot does not have six legs.
    """
    return list(six_legs(robot).legs)


def neutral_feet(legs: Sequence[LegKinematics]) -> Array:
    """Return the foot centres of the standing posture in the base frame [m]. Shape (6, 3)."""
    return np.array([leg.forward(leg.posture) for leg in legs])
