"""The same robot in MuJoCo: our URDF, servos, friction coefficient and set-points.

Its contact law is its own (default solver parameters). Where MuJoCo has a choice that costs
nothing but time it gets the cheap one: visual shapes discarded, fixed links fused, joint limits
off (our robots do not have them in a run either), only feet against the floor, loop in C.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np
from mujoco import rollout

import hexapod_pin as hp
from hexapod_pin.arrays import Array

SetPoints = Callable[[Array], tuple[Array, Array]]
"""Times (n,) [s] -> joint angles (n, joints) [rad] and rates [rad/s], `joint_names` order."""

CONES = ("pyramidal", "elliptic")
FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS
SAMPLE = 0.01
"""Time between the samples of `MujocoScene.positions` [s]."""


def friction_coefficient(contact: hp.Contact) -> float:
    """Return the coefficient MuJoCo gets: the largest the law reaches."""
    return contact.friction.limit


@dataclass
class MujocoScene:
    """One robot on a plane in MuJoCo, integrated by implicitfast.

    Attributes:
        scene: ours: robot, servo, gravity and coefficient of friction are taken from it.
        cone: "pyramidal" (MuJoCo's default) or "elliptic".
        step: integration step [s].
        exact: solve the contacts to 1e-12 (for reference runs); else MuJoCo's default, 1e-8.
    """

    scene: hp.Scene
    cone: str = "pyramidal"
    step: float = 1e-3
    exact: bool = False
    model: mujoco.MjModel = field(init=False)
    data: mujoco.MjData = field(init=False)

    def __post_init__(self) -> None:
        """Build and compile the model, and look our joints up by name."""
        self.model = self._compile()
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(name) for name in self.scene.robot.joint_names]
        self.qpos = np.array([joint.qposadr[0] for joint in joints])
        self.dof = np.array([joint.dofadr[0] for joint in joints])

    def _compile(self) -> Any:
        robot = self.scene.robot
        spec = mujoco.MjSpec.from_string(robot.urdf)
        spec.compiler.fusestatic, spec.compiler.discardvisual = True, True
        spec.worldbody.first_body().add_freejoint(name="root")
        spec.option.timestep, spec.option.gravity = self.step, list(self.scene.gravity)
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.cone = getattr(mujoco.mjtCone, f"mjCONE_{self.cone.upper()}")
        if self.exact:
            spec.option.tolerance, spec.option.iterations = 1e-12, 200
        self._only_feet_touch(spec)
        for name, effort in zip(robot.joint_names, robot.effort, strict=True):
            self._add_servo(spec, name, float(effort))
        return spec.compile()

    def _only_feet_touch(self, spec: Any) -> None:
        """Floor plane with our coefficient of friction; feet collide with it and nothing else."""
        ground = self.scene.terrain
        if not isinstance(ground, hp.Flat):
            raise TypeError(f"only Flat ground is compared, not {type(ground).__name__}")
        mu = friction_coefficient(self.scene.contact)
        feet = {foot.name for foot in self.scene.robot.feet}
        for geom in spec.geoms:
            shape = geom.contype != 0 and geom.parent.name in feet
            geom.contype, geom.conaffinity = 0, int(shape)
            if shape:
                geom.name = geom.parent.name
        spec.worldbody.add_geom(
            name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 0.1],
            pos=[0, 0, ground.height], contype=1, conaffinity=0,
            friction=[mu, 0.005, 0.0001], priority=1,
        )  # fmt: skip

    def _add_servo(self, spec: Any, name: str, effort: float) -> None:
        servo, joint = self.scene.servos, spec.joint(name)
        joint.limited = joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=servo.kp, kv=servo.kd)
        if servo.limited:
            actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
            actuator.forcerange = [-effort, effort]

    def put(self, state: hp.State) -> None:
        """Set our state: quaternion w first, base velocity turned into world axes."""
        data, q, v = self.data, state.q, state.v
        mujoco.mj_resetData(self.model, data)
        data.qpos[:3], data.qpos[3:7], data.qpos[self.qpos] = q[:3], q[[6, 3, 4, 5]], q[7:]
        mujoco.mju_rotVecQuat(data.qvel[:3], v[:3], data.qpos[3:7])
        data.qvel[3:6], data.qvel[self.dof] = v[3:6], v[6:]

    def controls(self, setpoints: SetPoints, first: int, steps: int) -> Array:
        """Return the set-points of steps first..first+steps-1, at their ends as in our step.

        MuJoCo's servo is kp (u - q) - kd v; u = q_ref + kd/kp v_ref makes it ours.

        Returns:
            u in MuJoCo's actuator order [rad]. Shape (steps, joints).
        """
        q, v = setpoints(np.arange(first + 1, first + steps + 1) * np.float64(self.step))
        return np.ascontiguousarray(q + self.scene.servos.kd / self.scene.servos.kp * v)

    def timed_run(self, state: hp.State, setpoints: SetPoints, steps: int) -> Callable[[], float]:
        """Return a function that walks `steps` steps in C and returns the wall time [s]."""
        control = self.controls(setpoints, 0, steps)[None]
        self.put(state)
        start = np.zeros((1, mujoco.mj_stateSize(self.model, FULL)))
        mujoco.mj_getState(self.model, self.data, start[0], FULL)
        states, sensors = np.empty((1, steps, start.shape[1])), np.empty((1, steps, 0))
        runner = rollout.Rollout(nthread=0)

        def run() -> float:
            begin = time.perf_counter()
            runner.rollout(
                [self.model], [self.data], start, control, skip_checks=True, nstep=steps,
                state=states, sensordata=sensors,
            )  # fmt: skip
            return time.perf_counter() - begin

        return run

    def positions(
        self, state: hp.State, setpoints: SetPoints, duration: float
    ) -> tuple[Array, float, float]:
        """Return the trunk's positions every 10 ms [m], mean contacts, mean solver iterations."""
        every = round(SAMPLE / self.step)
        samples = round(duration / SAMPLE)
        self.put(state)
        found, contacts, iterations = [np.array(state.q[:3])], 0, 0
        start = np.zeros((1, mujoco.mj_stateSize(self.model, FULL)))
        with rollout.Rollout(nthread=0) as runner:
            for k in range(samples):
                mujoco.mj_getState(self.model, self.data, start[0], FULL)
                runner.rollout(
                    self.model, self.data, start, self.controls(setpoints, k * every, every)[None],
                    initial_warmstart=np.array(self.data.qacc_warmstart),
                )  # fmt: skip
                found.append(np.array(self.data.qpos[:3]))
                contacts += self.data.ncon
                iterations += int(self.data.solver_niter[0])
        return np.array(found), contacts / samples, iterations / samples
