"""Run scenes: the Python face of the native core.

Python sets a run up, hands it over, and takes the samples back; it never sits inside a step.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import DivergenceError, ParameterError, SimulationInterrupted
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.trace import ENERGIES, Trace
from hexapod_pin.simulation.methods import MethodSettings, check_supported, resolve_method
from hexapod_pin.simulation.plant import native_plant, standing_on
from hexapod_pin.simulation.time_grid import TimeGrid, integer_ratio

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller, JointTrajectory
    from hexapod_pin.robot.robot import State
    from hexapod_pin.simulation.scene import Scene

LOOK_EVERY = 0.2
"""Simulated time between two looks at the keyboard and the progress bar [s]."""


@dataclass(frozen=True)
class Case:
    """One run of a batch: a scene, its controller, and where it starts (None: standing)."""

    scene: Scene
    controller: Controller
    initial: State | Checkpoint | None = None


@dataclass(frozen=True)
class RunSettings:
    """How to run: the method with its number, and the grid of samples.

    Attributes:
        choice: method, and its accuracy or step.
        grid: samples and steps.
        duration: simulated time [s].
    """

    choice: MethodSettings
    grid: TimeGrid
    duration: float

    @classmethod
    def of(
        cls,
        duration: float,
        method: str | None,
        accuracy: float | None,
        step: float | None,
        sample: float | None,
    ) -> RunSettings:
        """Check the settings of `simulate` against each other.

        Raises:
            ParameterError: one is out of range, or they do not fit together.
        """
        choice = resolve_method(method, accuracy, step)
        grid = (
            TimeGrid.adaptive(duration, sample)
            if choice.method.adaptive
            else TimeGrid.fixed(duration, choice.step, sample)
        )
        return cls(choice, grid, duration)


class Run:
    """A run under way: a native rollout and what its trace has to say about itself."""

    def __init__(self, case: Case, how: RunSettings) -> None:
        """JointTrajectory, check and set up; nothing is simulated yet."""
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
            standing_on(self.scene, self.plan.q[0])
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
            method=how.choice.method.name.replace("extrapolated-euler", "x3"),
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
        chunk = max(1, round(LOOK_EVERY / self.how.grid.sample))
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

    def require_good(self) -> Trace:
        """Return the trace.

        Raises:
            DivergenceError: the run left the finite world; names the joint and foot that led.
        """
        trace = self.trace()
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


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {name: version(name) for name in ("hexapod-pin", "pin", "numpy")}


def simulate(
    scene: Scene,
    controller: Controller,
    *,
    duration: float,
    accuracy: float | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    initial: State | Checkpoint | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trace:
    """Run a scene under a controller.

    Args:
        scene: robot, ground, contact, servos.
        controller: gives the joint set-points, e.g. `KinematicControl(gait)` or `HoldPosture()`.
        duration: simulated time [s]; 0 returns the initial sample.
        accuracy: error in positions to keep at the sampled times [m and rad]; default 1e-4.
        method: "extrapolated-euler" (adaptive, the default), "ndf" (1e-5 and tighter),
            "dop853" (explicit, for references); or with fixed steps "robust", "implicit-euler"
            (the default where a step is given), "rk4".
        step: integration step of a fixed-step method [s]; default 1 ms.
        sample: time between samples [s]. Adaptive: default 2 ms. Fixed steps: a whole number of
            steps, default 1 ms or one step.
        initial: state at t = 0; default standing at the controller's first set-point. Or a
            `Checkpoint` (`trace.checkpoint`) to go on from, at its own time.
        progress: called with the finished fraction (0..1) now and then.

    Returns:
        The trace, with the first sample at the start.

    Raises:
        ParameterError: a setting out of range, or a method that cannot do this scene.
        GaitError, ReachError: the controller cannot do this on this robot.
        StateError: `initial` does not fit the robot.
        DivergenceError: the run left the finite world; `.trace` holds what was good.
        SimulationInterrupted: Ctrl-C; `.trace` holds what was done.
    """
    how = RunSettings.of(duration, method, accuracy, step, sample)
    run = Run(Case(scene, controller, initial), how)
    run.advance(progress)
    return run.require_good()


def simulate_batch(
    cases: Sequence[Case],
    *,
    duration: float,
    accuracy: float | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    threads: int = 1,
) -> list[Trace]:
    """Run independent cases over threads; the bits do not depend on the number of threads.

    Args:
        cases: what to run.
        duration: simulated time [s], of every case.
        accuracy: as in `simulate` [m and rad].
        method: as in `simulate`.
        step: as in `simulate` [s].
        sample: as in `simulate` [s].
        threads: how many run at a time.

    Returns:
        One trace per case, in order.

    Raises:
        DivergenceError: of the first case that diverged, after all have been run.
        ParameterError, GaitError, ReachError, StateError: as in `simulate`, before anything runs.
    """
    from hexapod_pin import native as _native

    if threads < 1:
        raise ParameterError("threads", threads, "at least 1")
    how = RunSettings.of(duration, method, accuracy, step, sample)
    runs = [Run(case, how) for case in cases]
    begin = time.perf_counter()
    samples = [how.grid.samples] * len(runs)
    good = _native.advance_all([run.rollout for run in runs], samples, threads)
    wall_time = time.perf_counter() - begin
    for run, fine in zip(runs, good, strict=True):
        run.good, run.wall_time = bool(fine), wall_time / max(len(runs), 1)
    return [run.require_good() for run in runs]
