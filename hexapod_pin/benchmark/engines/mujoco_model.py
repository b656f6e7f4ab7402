"""A robot of ours in MuJoCo: our bodies, servos and coefficient of friction, its contact law.

Where MuJoCo has a choice that costs nothing but time it gets the cheap one: no visual shapes, fixed
links fused, no joint limits, only feet against the floor.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hexapod_pin.arrays import Array
    from hexapod_pin.robot.state import State

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
