"""A planned motion from standing, run by the native core: timed, and as the trunk's path."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin import native
from hexapod_pin.control.joint_trajectory import trajectory_curve
from hexapod_pin.errors import DivergenceError
from hexapod_pin.simulation.plant import native_plant
from studies.cost.mujoco_twin import SAMPLE, SetPoints, TrunkPath

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller, JointTrajectory
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene


@dataclass(frozen=True)
class NativeMotion:
    """One scene with its reference and its first state: standing at the first set-point.

    Attributes:
        scene: robot, contact, servos.
        plan: the joint reference.
        state: the state at t = 0.
    """

    scene: Scene
    plan: JointTrajectory
    state: State

    @classmethod
    def of(cls, scene: Scene, controller: Controller, duration: float) -> NativeMotion:
        """Plan a motion of `duration` [s]."""
        plan = controller.plan(scene.robot, duration)
        return cls(scene, plan, scene.robot.stand(plan.q[0]))

    @property
    def set_points(self) -> SetPoints:
        """The reference as a function of time, for MuJoCo."""
        angles = trajectory_curve(self.plan)
        rates, end = angles.derivative(), self.plan.time[-1]
        return lambda t: (angles(np.minimum(t, end)), rates(np.minimum(t, end)))

    def rollout(
        self, step: float, stride: int, *, method: str = "implicit-euler", dense: bool = False
    ) -> native.Rollout:
        """Return a run that has not begun, sampled every `stride` steps."""
        return native.start(
            native_plant(self.scene, dense=dense),
            time=[float(t) for t in self.plan.time],
            position=np.ascontiguousarray(self.plan.q),
            rate=np.ascontiguousarray(self.plan.v),
            kind=self.plan.kind,
            start=native.checkpoint(0, 0.0, self.state.q, self.state.v, np.zeros((0, 6)), ()),
            method=method, step=step, stride=stride, sample=step * stride, tolerance=0.0,
        )  # fmt: skip

    def timed_run(
        self, step: float, steps: int, *, stride: int | None = None,
        method: str = "implicit-euler", dense: bool = False,
    ) -> Callable[[], float]:  # fmt: skip
        """Return a function that runs `steps` steps and returns the wall time [s].

        A sample every `stride` steps; None: one at the end.
        """
        every = stride or steps

        def run() -> float:
            rollout = self.rollout(step, every, method=method, dense=dense)
            begin = time.perf_counter()
            good = rollout.advance(steps // every)
            taken = time.perf_counter() - begin
            _require(good, method, step)
            return taken

        return run

    def path(
        self, step: float, duration: float, *, method: str = "implicit-euler", dense: bool = False
    ) -> TrunkPath:
        """Return the trunk's path over a duration [s]."""
        run = self.rollout(step, round(SAMPLE / step), method=method, dense=dense)
        _require(run.advance(round(duration / SAMPLE)), method, step)
        record = run.record()
        down = (record["foot_gap"][1:] < 0.0).sum(axis=1).mean()
        return TrunkPath(record["q"][:, :3], float(down), run.counters())


def _require(good: bool, method: str, step: float) -> None:
    if not good:
        raise DivergenceError(f"{method} diverged at a step of {step:g} s", None)
