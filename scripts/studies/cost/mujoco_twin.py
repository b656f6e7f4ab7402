"""A scene of ours in MuJoCo, its set-points moving with every step, the loop over steps in C."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.engines.mujoco_engine import compile_model, put_state
from hexapod_pin.drive.servo import check_plain_drives
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import Flat
from hexapod_pin.interchange.mjcf_text import JointDrives, MjcfOptions

if TYPE_CHECKING:
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene

SetPoints = Callable[[Array], tuple[Array, Array]]
"""Times (n,) [s] -> joint angles (n, joints) [rad] and rates [rad/s], `joint_names` order."""

SAMPLE = 0.01
"""Time between the samples of a trunk's path [s]."""


@dataclass(frozen=True)
class TrunkPath:
    """Trunk positions every `SAMPLE`, shape (T, 3) [m]; mean number of feet down; counters."""

    positions: Array
    feet_down: float
    counters: dict[str, float]


@dataclass
class MujocoTwin:
    """One robot on a plane in MuJoCo, with our servos and coefficient of friction.

    Attributes:
        scene: ours.
        settings: of MuJoCo.
    """

    scene: Scene
    settings: MjcfOptions
    model: Any = field(init=False)
    data: Any = field(init=False)

    def __post_init__(self) -> None:
        """Build and compile the model.

        Raises:
            ParameterError: the ground is not `Flat`, a joint has a motor or dry friction, or there
                are loads.
        """
        self.scene.require_unloaded("in MuJoCo")
        scene, robot, servo = self.scene, self.scene.robot, self.scene.servos
        if not isinstance(scene.terrain, Flat):
            raise ParameterError("terrain", scene.terrain.kind, "flat in MuJoCo")
        check_plain_drives(robot, servo, "MuJoCo")
        self.model = compile_model(scene, JointDrives.of(robot, servo), self.settings)
        self.data = import_module("mujoco").MjData(self.model)

    def put(self, state: State) -> None:
        """Set our state."""
        put_state(self.model, self.data, self.scene.robot.joint_names, state)

    def controls(self, set_points: SetPoints, first: int, steps: int) -> Array:
        """Return the set-points of steps first..first+steps-1, at their ends as in our step.

        MuJoCo's servo is kp (u - q) - kd v; u = q_ref + kd/kp v_ref makes it ours.

        Returns:
            u in MuJoCo's actuator order [rad]. Shape (steps, joints).
        """
        q, v = set_points(np.arange(first + 1, first + steps + 1) * np.float64(self.settings.step))
        kp, kd = self.scene.servos.gains(self.scene.robot)
        return np.ascontiguousarray(q + kd / kp * v)

    def timed_run(self, state: State, set_points: SetPoints, steps: int) -> Callable[[], float]:
        """Return a function that walks `steps` steps in C and returns the wall time [s]."""
        control = self.controls(set_points, 0, steps)[None]
        self.put(state)
        start = self._full_state()
        states, sensors = np.empty((1, steps, start.shape[1])), np.empty((1, steps, 0))
        runner = import_module("mujoco.rollout").Rollout(nthread=0)

        def run() -> float:
            begin = time.perf_counter()
            runner.rollout(
                [self.model], [self.data], start, control, skip_checks=True, nstep=steps,
                state=states, sensordata=sensors,
            )  # fmt: skip
            return time.perf_counter() - begin

        return run

    def _full_state(self) -> Array:
        mujoco = import_module("mujoco")
        full = mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.zeros((1, mujoco.mj_stateSize(self.model, full)))
        mujoco.mj_getState(self.model, self.data, state[0], full)
        return state

    def path(self, state: State, set_points: SetPoints, duration: float) -> TrunkPath:
        """Return the trunk's path over a duration [s]."""
        every, samples = round(SAMPLE / self.settings.step), round(duration / SAMPLE)
        self.put(state)
        found, contacts, iterations = [np.array(state.q[:3])], 0, 0
        with import_module("mujoco.rollout").Rollout(nthread=0) as runner:
            for k in range(samples):
                runner.rollout(
                    self.model, self.data, self._full_state(),
                    self.controls(set_points, k * every, every)[None],
                    initial_warmstart=np.array(self.data.qacc_warmstart),
                )  # fmt: skip
                found.append(np.array(self.data.qpos[:3]))
                contacts += self.data.ncon
                iterations += int(self.data.solver_niter[0])
        steps = float(every * samples)
        counters = {
            "steps": steps, "evaluations": steps, "solver_iterations": iterations / samples,
        }  # fmt: skip
        return TrunkPath(np.array(found), contacts / samples, counters)
