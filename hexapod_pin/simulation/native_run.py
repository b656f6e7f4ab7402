"""One run of the native core: set up, advanced in chunks, turned into a trace.

Python never sits inside a step: it hands a run over and takes the samples back.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import DivergenceError, ParameterError, SimulationInterrupted
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_layout import ENERGIES
from hexapod_pin.simulation.methods import MethodSettings, check_supported
from hexapod_pin.simulation.plant import native_plant, standing_on
from hexapod_pin.simulation.time_grid import integer_ratio

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import JointTrajectory
    from hexapod_pin.robot.state import State
    from hexapod_pin.simulation.case import Case
    from hexapod_pin.simulation.run_settings import RunSettings

PROGRESS_INTERVAL = 0.2
"""Simulated time between two looks at the keyboard and the progress bar [s]."""


class NativeRun:
    """A run under way: a native rollout and what its trace has to say about itself."""

    def __init__(self, case: Case, how: RunSettings) -> None:
        """Plan, check and set up; nothing is simulated yet."""
        check_supported(how.choice, case.scene)
        self.scene, self.controller, self.how = case.scene, case.controller, how
        initial = case.initial
        begin = initial.time if isinstance(initial, Checkpoint) else 0.0
        horizon = begin + max(how.duration, how.grid.sample)
        self.plan: JointTrajectory = case.controller.plan(case.scene.robot, horizon)
        self.rollout = self._start(self._checkpoint(initial))
        self.good = True
        self.wall_time = 0.0

    def _checkpoint(self, initial: State | Checkpoint | None) -> Checkpoint:
        robot = self.scene.robot
        if isinstance(initial, Checkpoint):
            robot.check_state(initial.q, initial.v)
            return initial
        state = (
            standing_on(self.scene, self.plan.q[0], self.plan.start_pose)
            if initial is None
            else robot.check_state(initial.q, initial.v)
        )
        return Checkpoint(0.0, state.q, state.v, np.zeros((0, 6)))

    def _start(self, start: Checkpoint) -> Any:
        from hexapod_pin import native as _native

        plan, how = self.plan, self.how
        first = integer_ratio("start/sample", start.time, how.grid.sample)
        settings: dict[str, Any] = dict(
            plant=native_plant(self.scene),
            time=[float(t) for t in plan.time],
            position=np.ascontiguousarray(plan.q, dtype=float),
            rate=np.ascontiguousarray(plan.v, dtype=float),
            held=plan.held,
            start=_native.checkpoint(first, start.q, start.v, start.contacts, start.controller),
            method=how.choice.method.name,
            step=how.grid.step,
            stride=how.grid.stride,
            sample=how.grid.sample,
            accuracy=how.choice.accuracy,
        )
        try:
            return _native.start(**settings)
        except ValueError as error:  # what only the core knows: a method that cannot do a scene
            raise ParameterError("method", how.choice.method.name, str(error)) from None

    def advance(self, progress: Callable[[float], None] | None = None) -> None:
        """Run to the end in chunks, so that Ctrl-C and a progress bar get their turn.

        Raises:
            SimulationInterrupted: Ctrl-C; the samples so far are in the error.
        """
        begin = time.perf_counter()
        done, samples = 0, self.how.grid.samples
        self.rollout.reserve(samples)
        chunk = max(1, round(PROGRESS_INTERVAL / self.how.grid.sample))
        try:
            while done < samples and self.good:
                part = min(chunk, samples - done)
                self.good = self.rollout.advance(part)
                done += part
                if progress is not None:
                    progress(done / samples)
        except KeyboardInterrupt:
            self.wall_time = time.perf_counter() - begin
            trace = self.trace()
            raise SimulationInterrupted(
                f"interrupted after {trace.time[-1]:g} s of simulated time", trace
            ) from None
        self.wall_time = time.perf_counter() - begin

    def trace(self) -> Trace:
        """Return the samples so far."""
        record = self.rollout.record()
        for samples in record.values():  # own memory of each array: the trace takes them over
            samples.flags.writeable = False
        robot = self.scene.robot
        feet = len(robot.feet)
        energy = {name: record[name][:, 0] for name in ENERGIES}
        return Trace(
            time=record["time"][:, 0],
            **{name: record[name] for name in ("q", "v", "torque", "q_ref", "v_ref", "com")},
            **{
                name: record[name].reshape(-1, feet, 3)
                for name in ("foot_position", "foot_force", "foot_normal")
            },
            foot_gap=record["foot_gap"],
            energy=energy,
            counters={
                name: int(count) if float(count).is_integer() else float(count)
                for name, count in self.rollout.counters().items()
            },
            joint_names=robot.joint_names,
            foot_names=tuple(foot.name for foot in robot.feet),
            meta=self._meta(),
        )

    def _meta(self) -> dict[str, Any]:
        import tomli_w

        robot, plan = self.scene.robot, self.plan
        return {
            "scene": self.scene.to_toml(),
            "controller": tomli_w.dumps(self.controller.to_dict()),
            "method": self.how.choice.method.name,
            "accuracy": self.how.choice.accuracy,
            "step": self.how.grid.step,
            "sample": self.how.grid.sample,
            "checkpoint": self._stand().to_dict(),
            "cycle_time": plan.cycle_time,
            "steady_from": plan.steady_from,
            "steady_until": plan.steady_until,
            "travel_direction": [float(x) for x in plan.travel_direction],
            "nominal_speed": float(plan.speed),
            "robot_name": robot.name,
            "urdf": robot.urdf,
            "foot_radius": [float(foot.radius) for foot in robot.feet],
            "total_mass": robot.total_mass,
            "gravity": list(self.scene.gravity),
            "effort_limit": robot.effort.tolist(),
            "velocity_limit": robot.velocity.tolist(),
            "assumed": list(self.scene.assumed),
            "provenance": robot.provenance,
            "model_digest": robot.digest,
            "versions": _versions(),
            "wall_time": self.wall_time,
        }

    def _stand(self) -> Checkpoint:
        return Checkpoint.from_native(self.rollout.checkpoint(), self.how.grid.sample)

    def require_good(self, trace: Trace | None = None) -> Trace:
        """Return the trace, or the one already made.

        Raises:
            DivergenceError: the run left the finite world; names the joint and foot that led.
        """
        trace = self.trace() if trace is None else trace
        if self.good:
            return trace
        rate = np.abs(trace.v[-1, 6:])
        force = np.linalg.norm(trace.foot_force[-1], axis=1)
        culprits = []
        if rate.size:
            joint = int(rate.argmax())
            culprits.append(f"fastest joint {trace.joint_names[joint]} at {rate[joint]:.3g} rad/s")
        if force.size:
            foot = int(force.argmax())
            culprits.append(f"most loaded foot {trace.foot_names[foot]} with {force[foot]:.3g} N")
        raise DivergenceError(
            f"the run diverged after t = {trace.time[-1]:g} s ({'; '.join(culprits)}). "
            + _advice(self.how.choice),
            trace,
        )


def _advice(choice: MethodSettings) -> str:
    if choice.method.adaptive:
        return (
            f"No step of {choice.method.name!r} kept {choice.accuracy:g}: try method='robust', "
            "softer contact, or lower servo gains."
        )
    return (
        f"Try a smaller step than {choice.step:g} s, method='robust', softer contact, or lower "
        "servo gains."
    )


@cache
def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {name: version(name) for name in ("hexapod-pin", "pin", "numpy")}
