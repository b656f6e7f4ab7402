"""Hold one posture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.control.joint_trajectory import JointTrajectory, check_duration
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


@checked
@dataclass(frozen=True)
class HoldPosture:
    """Command constant joint angles.

    Attributes:
        q: joint angles, `Robot.joint_names` order [rad], shape (n,); or a mapping from joint name
            to angle, the others keeping the robot's posture; or None for the robot's posture.
    """

    q: ArrayLike | Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        """Keep an own copy of the angles."""
        if isinstance(self.q, Mapping):
            own: Any = {str(joint): float(angle) for joint, angle in self.q.items()}
        else:
            own = (
                None
                if self.q is None
                else tuple(np.atleast_1d(np.asarray(self.q, dtype=float)).tolist())
            )
        object.__setattr__(self, "q", own)

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the constant reference.

        Raises:
            ParameterError: wrong number of angles, or one not finite or outside its joint limits.
            UnknownNameError: the mapping names a joint the robot does not have.
        """
        q = self._angles(robot)
        for joint, angle, lower, upper in zip(
            robot.joint_names, q, robot.lower, robot.upper, strict=True
        ):
            if not lower <= angle <= upper:
                raise ParameterError(
                    f"HoldPosture.q[{joint}]", float(angle), f"{lower:.4f} to {upper:.4f} rad"
                )
        end = check_duration(duration)
        knots = np.tile(q, (2, 1))
        return JointTrajectory(
            time=np.array([0.0, end]),
            q=knots,
            v=np.zeros_like(knots),
            cycle_time=None,
            steady_from=0.0,
            steady_until=end,
            travel_direction=np.array([1.0, 0.0]),
            speed=0.0,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        if self.q is None:
            return {"kind": "hold"}
        given = self.q if isinstance(self.q, Mapping) else np.asarray(self.q).tolist()
        return {"kind": "hold", "q": given}

    def _angles(self, robot: Robot) -> NDArray[np.float64]:
        """Return the joint angles in `joint_names` order."""
        if self.q is None:
            return np.array(robot.posture)
        if isinstance(self.q, Mapping):
            q = np.array(robot.posture)
            for joint, angle in self.q.items():
                q[robot.joint_index(joint)] = angle
            return q
        q = np.asarray(self.q, dtype=float)
        if q.shape != (len(robot.joint_names),):
            raise ParameterError("HoldPosture.q", q.shape, f"{len(robot.joint_names)} joint angles")
        return q
