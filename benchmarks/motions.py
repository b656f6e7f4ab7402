"""What is simulated: standing and walking from standing, planned once, run by the native core."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from mujoco_scene import SAMPLE, Array, SetPoints
from scipy.interpolate import CubicHermiteSpline

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.control.joint_trajectory import Controller, JointTrajectory
from hexapod_pin.simulation.plant import native_plant


@dataclass(frozen=True)
class Motion:
    """One scene with its reference and its first state: standing at the first set-point.

    Attributes:
        scene: robot, contact, servos.
        plan: the joint reference.
        state: the state at t = 0.
    """

    scene: hp.Scene
    plan: JointTrajectory
    state: hp.State

    @classmethod
    def of(cls, scene: hp.Scene, controller: Controller, duration: float) -> Motion:
        """Plan a motion of `duration` [s]."""
        plan = controller.plan(scene.robot, duration)
        return cls(scene, plan, scene.robot.stand(plan.q[0]))

    @property
    def setpoints(self) -> SetPoints:
        """The reference as a function of time, for MuJoCo."""
        angles = CubicHermiteSpline(self.plan.time, self.plan.q, self.plan.v)
        rates = angles.derivative()
        return lambda t: (
            angles(np.minimum(t, self.plan.time[-1])),
            rates(np.minimum(t, self.plan.time[-1])),
        )

    def rollout(
        self,
        step: float,
        stride: int,
        *,
        method: str = "implicit-euler",
        plant: native.PlantSettings | None = None,
    ) -> native.Rollout:
        """Return a run that has not begun."""
        return native.start(
            plant or native_plant(self.scene),
            time=[float(t) for t in self.plan.time],
            position=np.ascontiguousarray(self.plan.q),
            rate=np.ascontiguousarray(self.plan.v),
            held=self.plan.held,
            start=native.checkpoint(0, self.state.q, self.state.v, np.zeros((0, 6)), ()),
            method=method, step=step, stride=stride, sample=step * stride, accuracy=0.0,
        )  # fmt: skip

    def timed_run(
        self, step: float, steps: int, *, stride: int | None = None, dense: bool = False
    ) -> Callable[[], float]:
        """Return a function that runs `steps` steps and returns the wall time [s].

        A sample every `stride` steps; None: one at the end.
        """
        every = stride or steps
        plant = native_plant(self.scene, dense=dense)

        def run() -> float:
            rollout = self.rollout(step, every, plant=plant)
            begin = time.perf_counter()
            good = rollout.advance(steps // every)
            taken = time.perf_counter() - begin
            if not good:
                raise RuntimeError(f"the run diverged at a step of {step:g} s")
            return taken

        return run

    def positions(
        self, step: float, duration: float, *, dense: bool = False
    ) -> tuple[Array, float, dict[str, float]]:
        """Return the trunk's positions every 10 ms [m], the mean feet down, and the counters."""
        plant = native_plant(self.scene, dense=dense)
        run = self.rollout(step, round(SAMPLE / step), plant=plant)
        if not run.advance(round(duration / SAMPLE)):
            raise RuntimeError(f"the run diverged at a step of {step:g} s")
        record = run.record()
        down = (record["foot_gap"][1:] < 0.0).sum(axis=1).mean()
        return record["q"][:, :3], float(down), run.counters()
