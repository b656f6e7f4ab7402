"""MuJoCo: implicitfast, Euler and RK4 with both friction cones, default contact parameters."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np

from hexapod_pin.benchmark.engines.engine import Ladder, Problem
from hexapod_pin.benchmark.entry import Outcome

INTEGRATORS = ("implicitfast", "Euler", "RK4")
CONES = ("pyramidal", "elliptic")
STEPS = (2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4, 5e-5, 2.5e-5)
QUICK_STEPS = (1e-3, 5e-4, 2.5e-4, 1e-4)


@dataclass
class Mujoco:
    """One problem in MuJoCo, the loop over steps in C."""

    problem: Problem
    name: str = "MuJoCo"
    law: str = "soft constraint (default solref 0.02 s), convex friction cone"
    _built: dict[tuple[str, float, bool], Any] = field(default_factory=dict, repr=False)

    def ladders(self, *, quick: bool) -> list[Ladder]:
        """Return six methods; each cone has its own reference, RK4 at a tenth of the last step."""
        steps = QUICK_STEPS if quick else STEPS
        fine = steps[-1] / 10.0
        return [
            Ladder(
                f"{integrator} {cone}", "step", steps,
                (f"RK4 {cone}", "step", fine), (f"RK4 {cone}", "step", 2.0 * fine),
            )
            for cone in CONES
            for integrator in INTEGRATORS
        ]  # fmt: skip

    def run(self, method: str, kind: str, value: float, *, exact: bool = False) -> Outcome:
        """Run the problem at a step [s]; see `Engine.run`."""
        mujoco = import_module("mujoco")
        model, data, controls = self._model(method, value, exact)
        task = self.problem.task
        each = round(task.sample / value)
        self._put(model, data)
        places = np.empty((task.samples + 1, 3))
        places[0] = data.qpos[:3]
        with _warnings(mujoco) as warned:
            begin = time.perf_counter()
            for k, control in enumerate(controls):
                data.ctrl[:] = control
                mujoco.mj_step(model, data, each)
                places[k + 1] = data.qpos[:3]
                if warned:
                    return Outcome.failed(f"diverged: {warned[0]}", time.perf_counter() - begin)
            wall = time.perf_counter() - begin
        steps = each * task.samples
        evaluations = 4 * steps if method.startswith("RK4") else steps
        return Outcome(places, None, wall, evaluations, steps, 0)

    def _model(self, method: str, step: float, exact: bool) -> Any:
        """Return the compiled model, its data, and the set-points in its actuator order."""
        key = (method, step, exact)
        if key not in self._built:
            mujoco = import_module("mujoco")
            model = self._compile(mujoco, method, step, exact)
            order = [self.problem.joints.index(model.actuator(k).name) for k in range(model.nu)]
            controls = np.ascontiguousarray(self.problem.setpoints[:, order])
            self._built[key] = (model, mujoco.MjData(model), controls)
        return self._built[key]

    def _compile(self, mujoco: Any, method: str, step: float, exact: bool) -> Any:
        problem = self.problem
        integrator, cone = method.split()
        spec = mujoco.MjSpec.from_string(problem.urdf)
        spec.compiler.balanceinertia = False
        spec.worldbody.first_body().add_freejoint(name="root")
        spec.option.timestep, spec.option.gravity = step, list(problem.gravity)
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
        spec.option.cone = getattr(mujoco.mjtCone, f"mjCONE_{cone.upper()}")
        if exact:
            spec.option.tolerance, spec.option.iterations = 1e-12, 200
        for geom in spec.geoms:
            geom.contype, geom.conaffinity = 0, 1
        spec.worldbody.add_geom(
            name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 0.1],
            pos=[0, 0, problem.height], contype=1, conaffinity=0,
            friction=[problem.mu, 0.005, 0.0001], priority=1,
        )  # fmt: skip
        for name, limit in zip(problem.joints, problem.limit, strict=True):
            actuator = spec.add_actuator(
                name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT
            )  # fmt: skip
            actuator.set_to_position(kp=problem.kp, kv=problem.kd)
            if np.isfinite(limit):
                actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
                actuator.forcerange = [-limit, limit]
        return spec.compile()

    def _put(self, model: Any, data: Any) -> None:
        """Set the first state: quaternion w first, base velocity turned into world axes."""
        mujoco = import_module("mujoco")
        state = self.problem.task.initial
        joints = [model.joint(name) for name in self.problem.joints]
        mujoco.mj_resetData(model, data)
        data.qpos[:3], data.qpos[3:7] = state.q[:3], state.q[[6, 3, 4, 5]]
        mujoco.mju_rotVecQuat(data.qvel[:3], state.v[:3], data.qpos[3:7])
        data.qvel[3:6] = state.v[3:6]
        data.qpos[[joint.qposadr[0] for joint in joints]] = state.q[7:]
        data.qvel[[joint.dofadr[0] for joint in joints]] = state.v[6:]


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
