"""Run scenes: the Python face of the native core.

Python sets a run up, hands it over, and takes the samples back; it never sits inside a step.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.errors import DivergenceError, ParameterError, SimulationInterrupted
from hexapod_pin.terrain import Plane
from hexapod_pin.trace import ENERGIES, Trace

if TYPE_CHECKING:
    from hexapod_pin.control.reference import Controller, Plan
    from hexapod_pin.robot import State
    from hexapod_pin.scene import Scene

Array = NDArray[np.float64]

METHODS = ("implicit-euler", "rk4")
CHUNK = 2000  # steps between two looks at the keyboard and the progress bar


@dataclass(frozen=True)
class Case:
    """One run of a batch: a scene, its controller, and where it starts (None: standing)."""

    scene: Scene
    controller: Controller
    initial: State | None = None


@dataclass(frozen=True)
class Grid:
    """The fixed time grid of a run: time = k * step, a sample every `stride` steps."""

    step: float
    steps: int
    stride: int

    @classmethod
    def of(cls, duration: float, step: float, sample: float | None) -> Grid:
        """Check the three times against each other.

        Args:
            duration: simulated time [s], a whole number of samples.
            step: integration step [s].
            sample: time between samples [s], a whole number of steps; None: 1 ms or one step.

        Raises:
            ParameterError: a time is not positive and finite, or they do not divide.
        """
        _require_time("step", step, smallest=0.0)
        _require_time("duration", duration, smallest=-1.0)
        if sample is not None:
            _require_time("sample", sample, smallest=0.0)
        stride = (
            max(1, round(1e-3 / step)) if sample is None else whole("sample/step", sample, step)
        )
        steps = whole("duration/step", duration, step)
        if steps % stride:
            raise ParameterError(
                "duration", duration, f"a whole number of samples of {stride * step:g} s"
            )
        return cls(step, steps, stride)


def whole(name: str, total: float, part: float) -> int:
    """Return total/part, which must be a whole number to 1e-9 of itself.

    Raises:
        ParameterError: it is not.
    """
    count = round(total / part)
    if abs(count * part - total) > 1e-9 * max(abs(total), part) or (count < 1 and total > 0.0):
        raise ParameterError(
            name, total / part, f"a whole number ({total:g} s is not a multiple of {part:g} s)"
        )
    return count


def _require_time(name: str, value: float, *, smallest: float) -> None:
    if not (math.isfinite(value) and value > smallest):
        raise ParameterError(name, value, "positive and finite [s]")


class Run:
    """A run under way: a native rollout and what its trace has to say about itself."""

    def __init__(self, case: Case, grid: Grid, method: str, duration: float) -> None:
        """Plan, check and set up; nothing is simulated yet."""
        if method not in METHODS:
            raise ParameterError("method", method, f"one of {', '.join(METHODS)}")
        self.scene, self.controller, self.grid, self.method = (
            case.scene,
            case.controller,
            grid,
            method,
        )
        self.plan: Plan = case.controller.plan(case.scene.robot, max(duration, grid.step))
        state = self._initial(case.initial)
        self.rollout = self._start(state)
        self.good = True
        self.wall_time = 0.0

    def _initial(self, state: State | None) -> State:
        robot = self.scene.robot
        if state is not None:
            return robot.check_state(state.q, state.v)
        return standing_on(self.scene, self.plan.q[0])

    def _start(self, state: State) -> Any:
        from hexapod_pin import native as _native

        plan = self.plan
        return _native.start(
            native_plant(self.scene),
            time=[float(t) for t in plan.time],
            position=np.ascontiguousarray(plan.q, dtype=float),
            rate=np.ascontiguousarray(plan.v, dtype=float),
            q=state.q,
            v=state.v,
            t0=0.0,
            step=self.grid.step,
            stride=self.grid.stride,
            method=self.method,
        )

    def advance(self, progress: Callable[[float], None] | None = None) -> None:
        """Run to the end in chunks, so that Ctrl-C and a progress bar get their turn.

        Raises:
            DivergenceError: the state left the finite world.
            SimulationInterrupted: Ctrl-C; the samples so far are in the error.
        """
        begin = time.perf_counter()
        done = 0
        try:
            while done < self.grid.steps and self.good:
                chunk = min(CHUNK, self.grid.steps - done)
                self.good = self.rollout.advance(chunk)
                done += chunk
                if progress is not None:
                    progress(done / self.grid.steps)
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
            counters={name: int(count) for name, count in self.rollout.counters().items()},
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
            "method": self.method,
            "step": self.grid.step,
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
            f"Try a smaller step than {self.grid.step:g} s, softer contact, or lower servo gains.",
            trace,
        )


def standing_on(scene: Scene, posture: Array) -> State:
    """Return the state at rest in a posture (n,) [rad], just touching the ground.

    On a plane the robot is laid along it; on any other ground it stands level.
    """
    import pinocchio as pin

    robot, surface = scene.robot, scene.terrain.surface()
    q = robot.stand(posture).q.copy()
    if isinstance(surface, Plane):
        tilt = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), np.array(surface.normal))
        q[:3], q[3:7] = tilt.toRotationMatrix() @ q[:3], tilt.coeffs()
    if robot.feet:
        data = robot.model.createData()
        pin.forwardKinematics(robot.model, data, q)
        joints = [_native_joint(robot, foot.joint) for foot in robot.feet]
        feet = zip(joints, robot.feet, strict=True)
        centers = [data.oMi[joint].act(foot.offset) for joint, foot in feet]
        q[2] += scene.terrain.lift(centers, [foot.radius for foot in robot.feet])
    return robot.check_state(q, np.zeros(robot.model.nv))


def native_plant(scene: Scene, *, dense: bool = False) -> Any:
    """Return the native settings of a scene's plant; `dense` avoids the block-arrow solver."""
    from hexapod_pin import native as _native

    robot, servo = scene.robot, scene.servos
    n = len(robot.joint_names)
    feet = [
        (_native_joint(robot, foot.joint), np.asarray(foot.offset, dtype=float), float(foot.radius))
        for foot in robot.feet
    ]
    limit = robot.effort if servo.limited else np.full(n, np.inf)
    return _native.plant_settings(
        model=robot.model.saveToString(),
        gravity=np.asarray(scene.gravity, dtype=float),
        feet=feet,
        normal=scene.contact.normal.native(),
        friction=scene.contact.friction.native(),
        terrain=scene.terrain.native(),
        kp=np.full(n, servo.kp),
        kd=np.full(n, servo.kd),
        limit=np.array(limit, dtype=float),
        damping=np.array(robot.damping, dtype=float),
        dense=dense,
    )


def _native_joint(robot: Any, joint: str) -> int:
    if not robot.model.existJointName(joint):
        raise ParameterError("foot joint", joint, f"a joint of {robot.name}")
    return int(robot.model.getJointId(joint))


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {name: version(name) for name in ("hexapod-pin", "pin", "numpy")}


def simulate(
    scene: Scene,
    controller: Controller,
    *,
    duration: float,
    method: str = "implicit-euler",
    step: float = 1e-3,
    sample: float | None = None,
    initial: State | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trace:
    """Run a scene under a controller.

    Args:
        scene: robot, ground, contact, servos.
        controller: gives the joint set-points, e.g. `KinematicControl(gait)` or `Hold()`.
        duration: simulated time [s]; 0 returns the initial sample.
        method: "implicit-euler" (linearly implicit, order 1, stable at 1 ms) or "rk4" (explicit,
            order 4 between contact events, needs a step below the contact's time scale).
        step: integration step [s].
        sample: time between samples [s], a whole number of steps; default 1 ms or one step.
        initial: state at t = 0; default standing at the controller's first set-point.
        progress: called with the finished fraction (0..1) now and then.

    Returns:
        The trace, with the first sample at t = 0.

    Raises:
        ParameterError: method, duration, step or sample out of range.
        GaitError, ReachError: the controller cannot do this on this robot.
        StateError: `initial` does not fit the robot.
        DivergenceError: the run left the finite world; `.trace` holds what was good.
        SimulationInterrupted: Ctrl-C; `.trace` holds what was done.
    """
    run = Run(Case(scene, controller, initial), Grid.of(duration, step, sample), method, duration)
    run.advance(progress)
    return run.require_good()


def simulate_batch(
    cases: Sequence[Case],
    *,
    duration: float,
    method: str = "implicit-euler",
    step: float = 1e-3,
    sample: float | None = None,
    threads: int = 1,
) -> list[Trace]:
    """Run independent cases over threads; the bits do not depend on the number of threads.

    Args:
        cases: what to run.
        duration: simulated time [s], of every case.
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
    grid = Grid.of(duration, step, sample)
    runs = [Run(case, grid, method, duration) for case in cases]
    begin = time.perf_counter()
    good = _native.advance_all([run.rollout for run in runs], [grid.steps] * len(runs), threads)
    wall_time = time.perf_counter() - begin
    for run, fine in zip(runs, good, strict=True):
        run.good, run.wall_time = bool(fine), wall_time / max(len(runs), 1)
    return [run.require_good() for run in runs]
