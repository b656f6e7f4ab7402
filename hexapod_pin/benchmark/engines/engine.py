"""What another engine is given, and what it must do."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.engines.urdf import engine_urdf
from hexapod_pin.benchmark.work_precision.entry import RunOutcome
from hexapod_pin.benchmark.work_precision.task import Task, setpoints
from hexapod_pin.drive.plain_drives import check_plain_drives
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import Flat
from hexapod_pin.validation.cases.robots import lowest_foot

MAX_INITIAL_DEPTH = 1e-4
"""Feet deeper in the ground than this at t = 0 are each engine's own problem [m]."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A task in the terms of another engine.

    The servos' damping is part of the joints' where the torque has no limit: set-points are held,
    so it is the same force, and engines treat joint damping best.

    Attributes:
        task: the task, its set-points held.
        urdf: text of the robot's URDF; joints carry our names.
        setpoints: (samples, n) angles commanded during each sample [rad].
        mu: coefficient of friction: the largest our law reaches.
        gravity: (3,) [m/s^2].
        height: of the ground [m].
        kp: (n,) servo stiffness [N m/rad].
        kd: (n,) servo damping that is not in the joints [N m s/rad].
        limit: (n,) largest servo torque [N m]; inf where there is none.
    """

    task: Task
    urdf: str = field(repr=False)
    setpoints: Array = field(repr=False)
    mu: float
    gravity: Array
    height: float
    kp: Array
    kd: Array
    limit: Array

    @classmethod
    def of(cls, task: Task) -> Problem:
        """Translate a task.

        Raises:
            ParameterError: the ground is not `Flat`, a foot is a point or starts in the ground, a
                joint is not revolute, has a motor or dry friction, or there are loads: engines
                cannot be compared on that.
        """
        scene, servo = task.scene, task.scene.servos
        scene.require_unloaded("in other engines")
        if not isinstance(scene.terrain, Flat):
            raise ParameterError("terrain", scene.terrain.kind, "flat in other engines")
        depth = scene.terrain.height - lowest_foot(scene.robot, task.initial.q)
        if depth > MAX_INITIAL_DEPTH:
            raise ParameterError(
                "depth of a foot at t = 0", round(depth, 6), f"at most {MAX_INITIAL_DEPTH:g} m",
                "How it is pushed out is a property of the contact law.",
            )  # fmt: skip
        n = len(scene.robot.joint_names)
        check_plain_drives(scene.robot, servo, "other engines")
        kp, all_kd = servo.gains(scene.robot)
        kd = all_kd if servo.limited else np.zeros(n)
        damping = np.array(scene.robot.damping) + (all_kd - kd)
        return cls(
            task=task, urdf=engine_urdf(scene.robot, damping), setpoints=setpoints(task),
            mu=scene.contact.friction.limit, gravity=np.array(scene.gravity),
            height=scene.terrain.height, kp=kp, kd=kd,
            limit=np.array(scene.robot.effort) if servo.limited else np.full(n, np.inf),
        )  # fmt: skip

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of `setpoints`."""
        return self.task.scene.robot.joint_names


@dataclass(frozen=True)
class EngineSweep:
    """The settings of one method of another engine.

    Attributes:
        method: name in tables.
        kind: "step" or "accuracy".
        values: loosest first [s or the engine's own measure].
        reference: (method, kind, value) of the reference run, at least 10 times finer.
        check: (method, kind, value) of the run that checks it.
    """

    method: str
    kind: str
    values: tuple[float, ...]
    reference: tuple[str, str, float]
    check: tuple[str, str, float]


class Engine(Protocol):
    """Another engine with a problem loaded."""

    name: str
    law: str

    def sweeps(self, *, quick: bool) -> list[EngineSweep]:
        """Return its methods and settings."""
        ...

    def run(self, method: str, kind: str, value: float, *, exact: bool = False) -> RunOutcome:
        """Run the problem once.

        Args:
            method: one of the sweeps'.
            kind: "step" or "accuracy".
            value: the step [s] or accuracy.
            exact: solve contacts as tightly as can be, for reference runs.
        """
        ...
