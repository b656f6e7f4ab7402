"""PyBullet: its multibody stepper; servos as torques, set once a step by this loop in Python.

Its own position control is no choice: its gain is a share of the error per step, so a smaller
step is another servo.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.engines.engine import EngineSweep, Problem
from hexapod_pin.benchmark.work_precision.measure import RunOutcome

STEPS = (2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4)
QUICK_STEPS = (1e-3, 5e-4, 2.5e-4)
STIFFNESS = 1e4
"""Of the contact [N/m]; near MuJoCo's default."""

DAMPING = 60.0
"""Of the contact [N s/m]."""

METHOD = "torque servo"


@dataclass
class Pybullet:
    """One problem in PyBullet, without a window."""

    problem: Problem
    name: str = "PyBullet"
    law: str = "spring-damper constraint, 1e4 N/m and 60 N s/m, friction pyramid"

    def sweeps(self, *, quick: bool) -> list[EngineSweep]:
        """Return one method; reference at a tenth of the last step."""
        steps = QUICK_STEPS if quick else STEPS
        fine = steps[-1] / 10.0
        return [
            EngineSweep(METHOD, "step", steps, (METHOD, "step", fine), (METHOD, "step", 2 * fine))
        ]

    def run(self, method: str, kind: str, value: float, *, exact: bool = False) -> RunOutcome:
        """Run the problem at a step [s]; see `Engine.run`."""
        bullet = import_module("pybullet")
        client = bullet.connect(bullet.DIRECT)
        try:
            return self._walk(bullet, value, exact)
        finally:
            bullet.disconnect(client)

    def _walk(self, bullet: Any, step: float, exact: bool) -> RunOutcome:
        task, problem = self.problem.task, self.problem
        robot, joints = self._load(bullet, step, exact)
        each = round(task.sample / step)
        places = np.empty((task.samples + 1, 3))
        places[0] = task.initial.q[:3]
        begin = time.perf_counter()
        for k, wanted in enumerate(problem.set_points):
            for _ in range(each):
                bullet.setJointMotorControlArray(
                    robot, joints, bullet.TORQUE_CONTROL,
                    forces=self._torque(bullet.getJointStates(robot, joints), wanted).tolist(),
                )  # fmt: skip
                bullet.stepSimulation()
            places[k + 1] = self._place(bullet, robot)
        wall = time.perf_counter() - begin
        if not np.isfinite(places).all() or np.abs(places).max() > 1e2:
            return RunOutcome.failed("diverged", wall)
        steps = each * task.samples
        return RunOutcome(places, None, wall, steps, steps, 0)

    def _torque(self, states: Any, wanted: Array) -> Array:
        """Return the servos' torques [N m]; damping is the joints' where there is no limit."""
        problem = self.problem
        torque: Array = problem.kp * (wanted - np.array([state[0] for state in states]))
        if problem.kd.any():
            torque -= problem.kd * np.array([state[1] for state in states])
        return np.clip(torque, -problem.limit, problem.limit)

    def _place(self, bullet: Any, robot: int) -> Array:
        """Return the origin of the trunk; PyBullet returns that of its centre of mass [m]."""
        place, attitude = bullet.getBasePositionAndOrientation(robot)
        return np.array(place) - _rotation(bullet, attitude) @ self._base_com()

    def _base_com(self) -> Array:
        model = self.problem.task.scene.robot.model
        return np.array(model.inertias[model.getJointId("root_joint")].lever)

    def _load(self, bullet: Any, step: float, exact: bool) -> tuple[int, list[int]]:
        """Build ground and robot and set the first state."""
        problem = self.problem
        bullet.setGravity(*problem.gravity.tolist())
        bullet.setTimeStep(step)
        bullet.setPhysicsEngineParameter(numSolverIterations=200 if exact else 50, numSubSteps=0)
        plane = bullet.createCollisionShape(bullet.GEOM_PLANE)
        ground = bullet.createMultiBody(0, plane, basePosition=[0, 0, problem.height])
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "robot.urdf"
            path.write_text(problem.urdf, encoding="utf-8")
            flags = bullet.URDF_USE_INERTIA_FROM_FILE | bullet.URDF_MAINTAIN_LINK_ORDER
            robot = int(bullet.loadURDF(str(path), flags=flags))
        count = bullet.getNumJoints(robot)
        index = {bullet.getJointInfo(robot, k)[1].decode(): k for k in range(count)}
        joints = [index[name] for name in problem.joints]
        touch = {"contactStiffness": STIFFNESS, "contactDamping": DAMPING}
        bullet.changeDynamics(ground, -1, lateralFriction=1.0, **touch)
        for link in range(-1, count):
            bullet.changeDynamics(
                robot, link, lateralFriction=problem.mu, linearDamping=0, angularDamping=0,
                maxJointVelocity=1000, **touch,
            )  # fmt: skip
        bullet.setJointMotorControlArray(
            robot, joints, bullet.VELOCITY_CONTROL, forces=[0.0] * len(joints)
        )
        self._put(bullet, robot, joints)
        return robot, joints

    def _put(self, bullet: Any, robot: int, joints: list[int]) -> None:
        state = self.problem.task.initial
        turned = _rotation(bullet, state.q[3:7].tolist())
        arm = turned @ self._base_com()
        spin = turned @ state.v[3:6]
        bullet.resetBasePositionAndOrientation(robot, state.q[:3] + arm, state.q[3:7].tolist())
        speed = turned @ state.v[:3] + np.cross(spin, arm)
        bullet.resetBaseVelocity(robot, speed.tolist(), spin.tolist())
        for joint, angle, rate in zip(joints, state.q[7:], state.v[6:], strict=True):
            bullet.resetJointState(robot, joint, float(angle), float(rate))


def _rotation(bullet: Any, attitude: Any) -> Array:
    return np.array(bullet.getMatrixFromQuaternion(attitude)).reshape(3, 3)
