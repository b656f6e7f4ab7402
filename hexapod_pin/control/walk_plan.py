"""A gait as a plan that a controller of your own reads at its ticks: angles, rates, feet.

`KinematicControl` plans a whole run. A controller that corrects the plan, or reacts to what its
sensors read, needs it at one instant, and the two directions of the legs' kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.control.gait_refusal import refuse_impossible
from hexapod_pin.control.leg_group import LegGroup, leg_group
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable

if TYPE_CHECKING:
    from hexapod_pin.control.foot_path import FootPath
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.robot.robot import Robot

HORIZON = 60.0
"""Time until which the roll of the feet is solved at once [s]."""


@dataclass(frozen=True, eq=False)
class PlannedInstant(Immutable):
    """What a plan has at an instant, or at each of K instants; L legs in gait order, n joints.

    Attributes:
        q: joint angles, `Robot.joint_names` order [rad]. Shape (..., n).
        v: joint rates [rad/s]. Shape (..., n).
        feet: centres of the feet, base frame [m]. Shape (..., L, 3).
        foot_velocity: their rates of change in the base frame [m/s]. Shape (..., L, 3).
        stance: which feet are to be on the ground. Shape (..., L).
    """

    q: Array
    v: Array
    feet: Array
    foot_velocity: Array
    stance: NDArray[np.bool_]


@checked
@dataclass(frozen=True)
class WalkPlan(Immutable):
    """A gait of a robot, read at any time from standing on.

    Attributes:
        robot: that walks.
        gait: which it walks.

    Raises:
        GaitError: the robot cannot walk the gait; it names what to change, and how far.

    Example:
        >>> plan = hp.motion.WalkPlan(robot, hp.Gait.tripod(stroke=0.06, cycle_time=0.8))
        >>> now = plan.at(1.25)
        >>> feet = now.feet + [0.0, 0.0, -0.005]  # 5 mm lower, legs in the order of plan.legs
        >>> q = plan.joint_angles(feet)
    """

    robot: Robot = field(repr=False)
    gait: Gait

    def __post_init__(self) -> None:
        """Refuse a gait that the robot cannot walk."""
        refuse_impossible(self.robot, self.gait)

    @cached_property
    def legs(self) -> tuple[str, ...]:
        """Names of the legs in the order of `PlannedInstant.feet`."""
        return tuple(leg.name for leg in self._group.legs)

    @cached_property
    def foot_index(self) -> NDArray[np.intp]:
        """Place of each leg's foot in `Measurement.foot_force` and `loaded`. Shape (L,)."""
        places = {foot.name: k for k, foot in enumerate(self.robot.feet)}
        return np.array([places[self.robot.leg(name).foot] for name in self.legs], dtype=np.intp)

    def at(self, time: ArrayLike) -> PlannedInstant:
        """Return the plan at a time, or at K times, ascending [s].

        The feet follow the same paths as those of `KinematicControl`; joint angles and rates are
        the inverse kinematics of them, exactly, where that interpolates between knots.

        Raises:
            ParameterError: a time before 0 or not finite, or times that do not ascend.
        """
        times = np.asarray(time, dtype=float)
        row = np.atleast_1d(times)
        if row.ndim != 1 or not (np.isfinite(row).all() and (np.diff(row, prepend=0.0) >= 0).all()):
            raise ParameterError("time", time, "one or more times from 0 s on, ascending")
        group, path = self._group, self._path
        p_BF, v_BF = group.foot_motion(path, row)
        q = group.kinematics.inverse_each(
            p_BF, np.repeat(group.kinematics.posture[:, None], len(row), 1)
        )
        v = group.kinematics.rates(v_BF, q)
        rows = (group.joint_rows(q, group.posture), group.joint_rows(v, 0.0))
        places = (np.swapaxes(p_BF, 0, 1), np.swapaxes(v_BF, 0, 1))
        at = 0 if times.ndim == 0 else slice(None)
        angles, rates, feet, speeds = (read_only(part[at]) for part in (*rows, *places))
        return PlannedInstant(angles, rates, feet, speeds, path.stance(row)[at])

    def feet(self, q: ArrayLike) -> Array:
        """Return the centres of all feet, base frame [m]: forward kinematics; see `LegGroup.feet`.

        Args:
            q: joint angles, `Robot.joint_names` order [rad]. Shape (..., n).

        Returns:
            Legs in the order of `legs`. Shape (..., L, 3).
        """
        return self._group.feet(q)

    def joint_angles(self, feet: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Return joint angles that put the feet at places: inverse kinematics.

        Args:
            feet: base frame, legs in the order of `legs` [m]. Shape (..., L, 3).
            near: angles to be nearest to by whole turns [rad], shape (..., n); None: as it stands.

        Returns:
            `Robot.joint_names` order [rad]. Shape (..., n).

        Raises:
            ReachError: of the first leg that cannot reach its place inside its joint limits.
        """
        places = np.asarray(feet, dtype=float)
        rows = places.reshape(-1, *places.shape[-2:])
        start = None if near is None else np.asarray(near, dtype=float).reshape(len(rows), -1)
        return self._group.joint_angles(rows, start).reshape(*places.shape[:-2], -1)

    @cached_property
    def _group(self) -> LegGroup:
        return leg_group(self.robot).along(self.gait)

    @cached_property
    def _path(self) -> FootPath:
        from hexapod_pin.control.foot_path import FootPath

        return FootPath.of(self._group, self.gait).solved_until(HORIZON)
