"""MuJoCo: implicitfast, Euler and RK4 with both friction cones, default contact parameters."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np

from hexapod_pin.benchmark.engines.engine import EngineSweep, Problem
from hexapod_pin.benchmark.engines.mujoco_model import (
    CONES,
    MujocoSettings,
    compile_model,
    put_state,
)
from hexapod_pin.benchmark.work_precision.entry import RunOutcome

INTEGRATORS = ("implicitfast", "Euler", "RK4")
STEPS = (2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4, 5e-5, 2.5e-5)
QUICK_STEPS = (1e-3, 5e-4, 2.5e-4, 1e-4)


@dataclass
class Mujoco:
    """One problem in MuJoCo, the loop over steps in C."""

    problem: Problem
    name: str = "MuJoCo"
    law: str = "soft constraint (default solref 0.02 s), convex friction cone"
    _built: dict[tuple[str, float, bool], Any] = field(default_factory=dict, repr=False)

    def sweeps(self, *, quick: bool) -> list[EngineSweep]:
        """Return six methods; each cone has its own reference, RK4 at a tenth of the last step."""
        steps = QUICK_STEPS if quick else STEPS
        fine = steps[-1] / 10.0
        return [
            EngineSweep(
                f"{integrator} {cone}", "step", steps,
                (f"RK4 {cone}", "step", fine), (f"RK4 {cone}", "step", 2.0 * fine),
            )
            for cone in CONES
            for integrator in INTEGRATORS
        ]  # fmt: skip

    def run(self, method: str, kind: str, value: float, *, exact: bool = False) -> RunOutcome:
        """Run the problem at a step [s]; see `Engine.run`."""
        mujoco = import_module("mujoco")
        model, data, controls = self._model(method, value, exact)
        task = self.problem.task
        each = round(task.sample / value)
        put_state(model, data, self.problem.joints, task.initial)
        places = np.empty((task.samples + 1, 3))
        places[0] = data.qpos[:3]
        with _warnings(mujoco) as warned:
            begin = time.perf_counter()
            for k, control in enumerate(controls):
                data.ctrl[:] = control
                mujoco.mj_step(model, data, each)
                places[k + 1] = data.qpos[:3]
                if warned:
                    return RunOutcome.failed(f"diverged: {warned[0]}", time.perf_counter() - begin)
            wall = time.perf_counter() - begin
        steps = each * task.samples
        evaluations = 4 * steps if method.startswith("RK4") else steps
        return RunOutcome(places, None, wall, evaluations, steps, 0)

    def _model(self, method: str, step: float, exact: bool) -> Any:
        """Return the compiled model, its data, and the set-points in its actuator order."""
        key, problem = (method, step, exact), self.problem
        if key not in self._built:
            integrator, cone = method.split()
            model = compile_model(
                problem.urdf, MujocoSettings(step, integrator, cone, exact),
                gravity=problem.gravity.tolist(), height=problem.height, mu=problem.mu,
                joints=problem.joints, kp=problem.kp, kd=problem.kd, limit=problem.limit,
            )  # fmt: skip
            order = [problem.joints.index(model.actuator(k).name) for k in range(model.nu)]
            controls = np.ascontiguousarray(problem.setpoints[:, order])
            self._built[key] = (model, import_module("mujoco").MjData(model), controls)
        return self._built[key]


@contextmanager
def _warnings(mujoco: Any) -> Iterator[list[str]]:
    """Collect MuJoCo's warnings, which are all of divergence, instead of its log file."""
    said: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(said.append)
    try:
        yield said
    finally:
        mujoco.set_mju_user_warning(before)
