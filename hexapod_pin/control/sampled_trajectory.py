"""Set-points held from one control tick to the next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.control.joint_trajectory import JointTrajectory, check_duration
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


@dataclass(frozen=True)
class SampledTrajectory:
    """Piecewise constant joint set-points, as a controller running at a fixed rate sends them.

    Attributes:
        time: when each begins, strictly increasing from 0 [s]. Shape (K,).
        q: joint angles, `Robot.joint_names` order [rad]. Shape (K, n). The last one stays.
    """

    time: ArrayLike
    q: ArrayLike

    def __post_init__(self) -> None:
        """Keep own, hashable copies."""
        time, q = np.asarray(self.time, dtype=float), np.asarray(self.q, dtype=float)
        if time.ndim != 1 or q.ndim != 2 or len(time) != len(q) or not len(time):
            raise ParameterError(
                "SampledTrajectory shapes", (time.shape, q.shape), "(K,) and (K, n), K >= 1"
            )
        object.__setattr__(self, "time", tuple(time.tolist()))
        object.__setattr__(self, "q", tuple(map(tuple, q.tolist())))

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the held reference.

        Raises:
            ParameterError: wrong number of joints, a number not finite, or times not
                increasing from 0.
        """
        q = np.array(self.q)
        if q.shape[1] != len(robot.joint_names):
            raise ParameterError("SampledTrajectory.q", q.shape, f"(K, {len(robot.joint_names)})")
        for knot, joint in np.argwhere(~np.isfinite(q)):
            raise ParameterError(
                f"SampledTrajectory.q of {robot.joint_names[joint]} at t = {self._begin(knot):g} s",
                float(q[knot, joint]),
                "finite [rad]",
            )
        return JointTrajectory(
            time=np.array(self.time),
            q=q,
            v=np.zeros_like(q),
            cycle_time=None,
            steady_from=0.0,
            steady_until=check_duration(duration),
            travel_direction=np.array([1.0, 0.0]),
            speed=0.0,
            held=True,
        )

    def _begin(self, knot: int) -> float:
        return float(np.asarray(self.time)[knot])

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        return {
            "kind": "held",
            "time": np.asarray(self.time).tolist(),
            "q": np.asarray(self.q).tolist(),
        }
