"""A short scene in which a law acts, by the native core and by the second right-hand side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.joint_trajectory import JointTrajectory, TrajectoryKind, check_duration
from hexapod_pin.validation.position_error import PositionError
from oracles.second_rhs.integrate import integrate
from oracles.second_rhs.switch import SecondRun

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class GivenSetPoints:
    """Set-points through knots, taken as they are. Shapes (K,) [s], (K, n) [rad, rad/s]."""

    time: Array
    q: Array
    v: Array
    kind: TrajectoryKind = "cubic"

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the reference."""
        return JointTrajectory(
            time=self.time, q=self.q, v=self.v, cycle_time=None, steady_from=0.0,
            steady_until=check_duration(duration), travel_direction=np.array([1.0, 0.0]),
            speed=0.0, kind=self.kind,
        )  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        knots = {name: getattr(self, name).tolist() for name in ("time", "q", "v")}
        return {"kind": "given", "knots": self.kind, **knots}


@dataclass(frozen=True, eq=False)
class LawScene:
    """A scene, its commands, its start and how long it lasts [s]."""

    name: str
    scene: Scene
    controller: Controller
    initial: State
    duration: float
    sample: float

    def by_scipy(self, tolerance: float) -> SecondRun:
        """Return the run of the second right-hand side."""
        return integrate(
            self.scene, self.controller, duration=self.duration, initial=self.initial,
            tolerance=tolerance, sample=self.sample,
        )  # fmt: skip

    def by_core(self, **settings: Any) -> Array:
        """Return q (T, nq) of the native core; `settings` are method and accuracy."""
        from hexapod_pin.simulation.case import simulate

        trace = simulate(
            self.scene, self.controller, duration=self.duration, initial=self.initial,
            sample=self.sample, **settings,
        )  # fmt: skip
        return trace.q


def difference(scene: LawScene, wanted: Array, **settings: Any) -> PositionError:
    """Return how far the native core with these settings is from configurations (T, nq)."""
    return PositionError.between(scene.by_core(**settings), wanted)
