"""MuJoCo runs a robot of ours, and a scene of ours with moving set-points."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.benchmark.engines.engine import EngineSweep, Problem
from hexapod_pin.benchmark.work_precision.measure import RunOutcome

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hexapod_pin.arrays import Array
    from hexapod_pin.robot.state import State


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
# Where MuJoCo has a choice that costs nothing but time it gets the cheap one: no visual shapes,
# fixed links fused, no joint limits, only feet against the floor.

CONES = ("pyramidal", "elliptic")


@dataclass(frozen=True)
class MujocoSettings:
    """How MuJoCo integrates.

    Attributes:
        step: [s].
        integrator: "implicitfast", "Euler" or "RK4".
        cone: "pyramidal" (its default) or "elliptic".
        exact: contacts solved to 1e-12, for reference runs; else its default, 1e-8.
    """

    step: float
    integrator: str = "implicitfast"
    cone: str = "pyramidal"
    exact: bool = False


def compile_model(
    urdf: str, settings: MujocoSettings, *, gravity: Sequence[float], height: float, mu: float,
    joints: Sequence[str], kp: Array, kd: Array, limit: Array,
) -> Any:  # fmt: skip
    """Return the compiled model.

    Args:
        urdf: text of `engine_urdf`.
        settings: step, integrator, cone, solver tolerance.
        gravity: (3,) [m/s^2].
        height: of the floor [m].
        mu: coefficient of friction.
        joints: names of the joints with a servo.
        kp: (n,) servo stiffness [N m/rad].
        kd: (n,) servo damping [N m s/rad].
        limit: (n,) largest servo torque [N m]; inf where there is none.
    """
    mujoco = import_module("mujoco")
    spec = mujoco.MjSpec.from_string(urdf)
    spec.compiler.balanceinertia = False
    spec.worldbody.first_body().add_freejoint(name="root")
    spec.option.timestep, spec.option.gravity = settings.step, list(gravity)
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{settings.integrator.upper()}")
    spec.option.cone = getattr(mujoco.mjtCone, f"mjCONE_{settings.cone.upper()}")
    if settings.exact:
        spec.option.tolerance, spec.option.iterations = 1e-12, 200
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = 0, 1
    spec.worldbody.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 0.1], pos=[0, 0, height],
        contype=1, conaffinity=0, friction=[mu, 0.005, 0.0001], priority=1,
    )  # fmt: skip
    for name, stiffness, damping, most in zip(joints, kp, kd, limit, strict=True):
        joint = spec.joint(name)
        joint.limited = joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=float(stiffness), kv=float(damping))
        if np.isfinite(most):
            actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
            actuator.forcerange = [-most, most]
    return spec.compile()


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
