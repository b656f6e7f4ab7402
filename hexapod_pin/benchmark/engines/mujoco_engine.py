"""MuJoCo runs a robot of ours, and a scene of ours with moving set-points."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.benchmark.engines.engine import EngineSweep, Problem
from hexapod_pin.benchmark.work_precision.measure import RunOutcome
from hexapod_pin.interchange.mjcf_text import JointDrives, MjcfOptions, mjcf_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene


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
                problem.task.scene, problem.drives, MjcfOptions(step, integrator, cone, exact=exact)
            )
            order = [problem.joints.index(model.actuator(k).name) for k in range(model.nu)]
            controls = np.ascontiguousarray(problem.set_points[:, order])
            self._built[key] = (model, import_module("mujoco").MjData(model), controls)
        return self._built[key]


@contextmanager
def _warnings(mujoco: Any) -> Iterator[list[str]]:
    """Collect MuJoCo's warnings, which are all of divergence, instead of its log file."""
    warned: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(warned.append)
    try:
        yield warned
    finally:
        mujoco.set_mju_user_warning(before)


# A robot of ours in MuJoCo: our bodies, servos and coefficient of friction, its contact law.
#
# Where MuJoCo has a choice that costs nothing but time it gets the cheap one: no shapes but the
# feet's, no joint limits, only feet against the floor.

CONES = ("pyramidal", "elliptic")


def compile_model(scene: Scene, drives: JointDrives, options: MjcfOptions) -> Any:
    """Return the compiled model of a scene; see `hexapod_pin.interchange`.

    Args:
        scene: robot, ground, coefficient of friction, gravity.
        drives: of its joints.
        options: step, integrator, cone, solver tolerance; joint limits are left out.
    """
    text = mjcf_text(scene, drives, replace(options, joint_limits=False))
    return import_module("mujoco").MjModel.from_xml_string(text)


def put_state(model: Any, data: Any, joints: Sequence[str], state: State) -> None:
    """Set our state: quaternion w first, base velocity turned into world axes."""
    mujoco = import_module("mujoco")
    places = [model.joint(name) for name in joints]
    mujoco.mj_resetData(model, data)
    data.qpos[:3], data.qpos[3:7] = state.q[:3], state.q[[6, 3, 4, 5]]
    mujoco.mju_rotVecQuat(data.qvel[:3], state.v[:3], data.qpos[3:7])
    data.qvel[3:6] = state.v[3:6]
    data.qpos[[joint.qposadr[0] for joint in places]] = state.q[7:]
    data.qvel[[joint.dofadr[0] for joint in places]] = state.v[6:]
