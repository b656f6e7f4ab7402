"""What is measured: a scene, its controller and first state, how long, and at which times."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.joint_trajectory import planned_motion
from hexapod_pin.control.sampled_trajectory import SampledTrajectory
from hexapod_pin.errors import ParameterError
from hexapod_pin.scene.scene import standing_on
from hexapod_pin.simulation.run_settings import integer_ratio

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller, JointTrajectory
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene

LONGEST = 1e4
"""Longest task [s]: every method on it is compared with far more accurate runs."""

MOST_SAMPLES = 200_000
"""Of a task: each of its many runs stores them all, and no step is longer than their distance."""


@dataclass(frozen=True, eq=False)
class Task:
    """One problem, the same for every method and engine.

    Attributes:
        name: how it is called in tables.
        scene: robot, ground, contact, servos.
        controller: gives the joint set-points.
        initial: state at t = 0.
        duration: simulated time [s], a whole number of samples.
        sample: time between the samples at which runs are compared [s].
        answer: (7 + n,) configuration at the end, known from elsewhere [m, -, rad]; None if not.
        about: one line for the head of a report.
    """

    name: str
    scene: Scene
    controller: Controller
    initial: State
    duration: float
    sample: float
    answer: Array | None = field(default=None, repr=False)
    about: str = ""

    def __post_init__(self) -> None:
        """Check the times.

        Raises:
            ParameterError: the duration is not a whole number of samples, or of more than
                `MOST_SAMPLES`.
        """
        samples = integer_ratio("duration/sample", self.duration, self.sample)
        if samples > MOST_SAMPLES:
            least = f"at least {self.duration / MOST_SAMPLES:g} s: {MOST_SAMPLES} samples at most"
            raise ParameterError("sample", self.sample, least)

    @property
    def samples(self) -> int:
        """Number of samples after t = 0."""
        return round(self.duration / self.sample)

    @property
    def begins(self) -> Array:
        """Times at which the samples' intervals begin [s]. Shape (samples,)."""
        return np.asarray(np.arange(self.samples) * self.sample, dtype=np.float64)


def standing_task(
    name: str, scene: Scene, controller: Controller, *, duration: float, sample: float,
    initial: State | None = None, about: str = "",
) -> Task:  # fmt: skip
    """Return a task that starts standing at the controller's first set-point, or at `initial`.

    Raises:
        GaitError, ReachError: the controller cannot do this on this robot.
        ParameterError: the times do not fit each other, or more than `LONGEST`.
    """
    if duration > LONGEST:
        raise ParameterError("duration", duration, f"at most {LONGEST:g} s")
    plan = controller.plan(scene.robot, duration)
    first = standing_on(scene, plan.q[0], plan.start_pose) if initial is None else initial
    return Task(name, scene, controller, first, duration, sample, about=about)


def held_task(task: Task) -> Task:
    """Return the task with set-points held from sample to sample: what every engine can do alike.

    A controller that holds already, or that holds one posture, is left as it is. The
    set-points jump at once: no engine but this one limits their velocity.
    """
    plan = task.controller.plan(task.scene.robot, task.duration)
    if plan.held or _constant(plan):
        return task
    controller = SampledTrajectory(task.begins, planned_motion(plan, task.begins)[0], limited=False)
    return replace(task, controller=controller, answer=None)


def set_points(task: Task) -> Array:
    """Return the angles commanded during each sample, `joint_names` order [rad].

    Only of a task from `held_task`.

    Returns:
        Shape (samples, n).

    Raises:
        ParameterError: a set-point begins between two samples.
    """
    plan = task.controller.plan(task.scene.robot, task.duration)
    if not plan.held:
        return np.tile(plan.q[0], (task.samples, 1))
    begin = plan.time[plan.time < task.duration - 1e-9]
    if np.abs(begin / task.sample - np.round(begin / task.sample)).max() > 1e-6:
        raise ParameterError("sample", task.sample, "a divisor of the times of the set-points [s]")
    held: Array = plan.q[np.searchsorted(plan.time, task.begins + 1e-9, side="right") - 1]
    return held


def _constant(plan: JointTrajectory) -> bool:
    return not np.ptp(plan.q, axis=0).any() and not plan.v.any()
