"""The legs of a walking robot, in gait order, with what a plan needs of each.

Four to eight legs of two or three joints each, all with the same number; L legs of J joints.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arguments import checked, every_step
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.control.gait import LEG_COUNTS, LEG_ORDER, Gait, gaits_for
from hexapod_pin.errors import GaitError
from hexapod_pin.immutable import ComparedByContent
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.leg_set import LegSet
from hexapod_pin.robot.robot import once_per_robot

if TYPE_CHECKING:
    from hexapod_pin.control.commanded_body import VelocityCommand
    from hexapod_pin.robot.robot import Robot


class FootMotion(Protocol):
    """What moves the feet: `FootPath` or `ArcPath`."""

    def positions_and_velocities(self, time: Array) -> tuple[Array, Array]:
        """Return places [m] and velocities [m/s] of the feet, base frame. Shape (K, L, 3) each."""


STRAIGHT_AHEAD = 1e-6
"""A leg less than this to the right of straight ahead is the first on the left [rad]."""

MAX_TURN_OF_TRAVEL = 1e-6
"""Directions of travel that differ by less are one [rad]."""

KEPT_DIRECTIONS = 64
"""How many sets of legs with their directions of travel are cached."""


@dataclass(frozen=True, eq=False)
class LegGroup(ComparedByContent):
    """Legs in gait order; one instance per robot and direction of travel.

    Attributes:
        robot_name: of the robot.
        kinematics: the legs with stacked geometry.
        radius: of each foot sphere [m]. Shape (L,).
        soles: lowest point of each foot in the standing posture, base frame [m]. Shape (L,).
        max_rate: joint velocity limits [rad/s]. Shape (L, J).
        joint_index: place of each leg's joints in `Robot.joint_names`. Shape (L, J).
        posture: standing angles of all joints of the robot, held ones included [rad]. Shape (n,).
    """

    robot_name: str
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
        """Foot centres of the standing posture, base frame [m]. Shape (L, 3)."""
        return self.kinematics.neutral_feet

    def fitted(self, gait: Gait) -> Gait:
        """Return a gait with a phase for each of these legs, in their order.

        Raises:
            GaitError: it has phases for other legs, or another number; names the gaits that fit.
        """
        names, count = [leg.name for leg in self.legs], len(gait.phases)
        if gait.leg_names is None and count == len(names):
            return gait
        if gait.leg_names is not None and sorted(gait.leg_names) == sorted(names):
            phase = dict(zip(gait.leg_names, gait.phases, strict=True))
            fields = {**gait.model_dump(), "phases": tuple(phase[name] for name in names)}
            return Gait(**{**fields, "leg_names": None})
        given = "" if gait.leg_names is None else f" ({', '.join(gait.leg_names)})"
        raise GaitError(
            f"gait {gait.name} has phases for {count} legs{given}; robot {self.robot_name} has "
            f"{len(names)} ({', '.join(names)}). Gaits that fit {len(names)} legs: "
            f"{', '.join(gaits_for(len(names)))}, or Gait.custom with a phase for each leg.",
            "phases",
            None,
        )

    def along(self, gait: Gait, command: VelocityCommand | None = None) -> LegGroup:
        """Return the legs, the feet of two-joint legs on the course of a gait or a command.

        Legs of three joints follow any path: they are returned as they are.

        Raises:
            GaitError: a command changes the direction in which a two-joint leg has to travel.
        """
        if self.kinematics.task is None:
            return self
        turn = gait.turn_rate
        twists = np.array([[gait.speed * f(gait.heading) for f in (np.cos, np.sin)] + [turn]])
        if command is not None:
            twists = command.twists[command.twists.any(axis=1)]
        directions = _directions(self, twists if len(twists) else np.zeros((1, 3)))
        return _along(self, tuple(map(tuple, np.round(directions, 12).tolist())))

    def foot_motion(self, path: FootMotion, time: Array) -> tuple[Array, Array]:
        """Return foot positions [m] and velocities [m/s] leg by leg, base frame. (L, K, 3) each."""
        p_BF, v_BF = path.positions_and_velocities(time)
        first, second = (np.ascontiguousarray(np.swapaxes(x, 0, 1)) for x in (p_BF, v_BF))
        return first, second

    def joint_rows(self, values: Array, others: ArrayLike) -> Array:
        """Return values of the legs' joints (L, K, J) with a row per time, `joint_names` order.

        Args:
            values: of the legs' joints. Shape (L, K, J).
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

    @every_step
    def joint_angles(self, feet: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Return the joint angles that put the feet at given places: inverse kinematics.

        Args:
            feet: centres of the feet, base frame, legs in gait order [m]. Shape (B, L, 3).
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

    @every_step
    def feet(self, q: ArrayLike) -> Array:
        """Return the centres of all feet: forward kinematics.

        Args:
            q: joint angles, `Robot.joint_names` order [rad]. Shape (..., n).

        Returns:
            Base frame, legs in gait order [m]. Shape (..., L, 3).
        """
        angles = np.asarray(q, dtype=float)
        rows = angles.reshape(-1, angles.shape[-1])[:, self.joint_index]
        places = self.kinematics.chain.forward(np.swapaxes(rows, 0, 1))
        return np.swapaxes(places, 0, 1).reshape(*angles.shape[:-1], len(self.legs), 3)

    def _joint_angles(self, feet: Array, rows: Array) -> Array:
        """Return the same for legs of any shape, or raise the error of a leg that cannot."""
        p_BF = np.ascontiguousarray(np.swapaxes(feet, 0, 1))
        start = np.swapaxes(rows[:, self.joint_index], 0, 1)
        return self.joint_rows(self.kinematics.inverse_each(p_BF, start), rows)

    def leg_rows(self, row: Array) -> Array:
        """Return a row (n,) of joint values leg by leg. Shape (L, J)."""
        legs: Array = row[self.joint_index]
        return legs


@checked
@once_per_robot
def leg_group(robot: Robot) -> LegGroup:
    """Return the legs of a robot in gait order.

    Raises:
        GaitError: the robot has no legs to walk with, or legs of two and of three joints.
    """
    if len(robot.legs) not in LEG_COUNTS:
        raise GaitError(
            f"robot {robot.name} has {len(robot.legs)} legs that a gait can move; a gait needs "
            "4 to 8. State them in the file: <hexapod_pin><leg name= joints= foot=/>.",
            "legs",
            None,
        )
    if len({len(leg.joints) for leg in robot.legs}) > 1:
        counts = ", ".join(f"{leg.name} {len(leg.joints)}" for leg in robot.legs)
        raise GaitError(
            f"robot {robot.name}: its legs walk with different numbers of joints ({counts}); "
            "give all the same number, and state surplus joints as <held>.",
            "legs",
            None,
        )
    legs = _in_gait_order([LegKinematics.of(robot, leg.name) for leg in robot.legs])
    index = np.array([[robot.joint_index(joint) for joint in leg.joints] for leg in legs])
    radius = np.array([robot.foot(robot.leg(leg.name).foot).radius for leg in legs])
    kinematics = LegSet.of(legs)
    return LegGroup(
        robot_name=robot.name,
        kinematics=kinematics,
        radius=read_only(radius),
        soles=read_only(kinematics.neutral_feet[:, 2] - radius),
        max_rate=read_only(robot.velocity_limit[index]),
        joint_index=index,
        posture=read_only(robot.posture),
    )


@checked
def leg_order(robot: Robot) -> tuple[str, ...]:
    """Return the names of a robot's legs in gait order, that of `Gait.phases`.

    Six legs lf lm lr rf rm rr are in this order. Others go by where they stand: left from front to
    rear, then right from front to rear, with an odd number the one more on the left.

    Raises:
        GaitError: the robot has no legs that a gait can move.
    """
    return tuple(leg.name for leg in leg_group(robot).legs)


def require_six_of_three(robot: Robot, what: str, *, held: bool = True) -> LegGroup:
    """Return the legs of a robot with the six three-joint legs that something needs.

    Raises:
        GaitError: the robot has other legs, or held joints; it names what needs them.
    """
    legs = leg_group(robot)
    if legs.joint_index.shape != (6, 3):
        count, joints = legs.joint_index.shape
        raise GaitError(
            f"{what} needs six legs of three joints; robot {robot.name} has {count} of {joints}. "
            "KinematicControl walks with 4 to 8 legs of two or three joints.",
            "legs",
            None,
        )
    if robot.held and not held:
        raise GaitError(
            f"{what} takes no robot with held joints; {robot.name} holds "
            f"{', '.join(robot.held)}. KinematicControl does, or make them fixed.",
            "legs",
            None,
        )
    return legs


def _in_gait_order(legs: list[LegKinematics]) -> list[LegKinematics]:
    """Return legs in the order of `leg_order`: around from the front over the left, in halves."""
    if sorted(leg.name for leg in legs) == sorted(LEG_ORDER):
        return sorted(legs, key=lambda leg: LEG_ORDER.index(leg.name))
    feet = np.array([leg.forward(leg.posture) for leg in legs])[:, :2]
    x, y = (feet - feet.mean(axis=0)).T
    angle = np.mod(np.arctan2(y, x) + STRAIGHT_AHEAD, 2.0 * np.pi)
    around = [legs[k] for k in np.argsort(angle, kind="stable")]
    left = (len(legs) + 1) // 2
    return around[:left] + around[left:][::-1]


def _directions(legs: LegGroup, twists: Array) -> Array:
    """Return the direction in which each foot travels under a body's twists (S, 3). (L, 3).

    Raises:
        GaitError: a leg has to travel in different directions.
    """
    x, y = legs.neutral_feet[:, 0], legs.neutral_feet[:, 1]
    vx, vy, turn = twists.T[..., None]
    ground = np.stack([vx - turn * y, vy + turn * x, 0.0 * (turn + x)], axis=-1)
    speed = np.linalg.norm(ground, axis=-1)
    fastest = ground[np.argmax(speed, axis=0), np.arange(len(x))]
    length = np.linalg.norm(fastest, axis=-1, keepdims=True)
    ahead = np.where(length > 0.0, fastest / np.where(length > 0.0, length, 1.0), (1.0, 0.0, 0.0))
    aside = np.linalg.norm(np.cross(ground, ahead), axis=-1) > MAX_TURN_OF_TRAVEL * speed
    if aside.any():
        leg = legs.legs[int(np.argmax(aside.any(axis=0)))]
        raise GaitError(
            f"leg {leg.name} has two joints: its foot follows one direction of travel, and this "
            "velocity command requires several. Keep the ratio of speeds and turn rate.",
            "velocity",
            None,
        )
    return ahead


@lru_cache(maxsize=KEPT_DIRECTIONS)
def _along(legs: LegGroup, directions: tuple[tuple[float, ...], ...]) -> LegGroup:
    """Return legs whose feet travel in these directions, one per leg; always the same instance."""
    turned = [leg.along(one) for leg, one in zip(legs.legs, directions, strict=True)]
    same = all(
        np.array_equal(new.task, old.task)
        for new, old in zip(turned, legs.legs, strict=True)
        if new.task is not None and old.task is not None
    )
    return legs if same else replace(legs, kinematics=LegSet.of(turned))
