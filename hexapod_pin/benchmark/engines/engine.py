"""Another engine receives one URDF and runs a task; those that are installed are entries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.work_precision.measure import ReferenceSolution, RunOutcome
from hexapod_pin.benchmark.work_precision.task import Task, set_points
from hexapod_pin.drive.servo import check_plain_drives
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import Flat
from hexapod_pin.interchange.mjcf_text import JointDrives
from hexapod_pin.robot.description import urdf_writer as xml
from hexapod_pin.robot.description.urdf_writer import Shape
from hexapod_pin.validation.cases.robots import lowest_foot
from hexapod_pin.validation.solver_setting import setting_text

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


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
        set_points: (samples, n) angles commanded during each sample [rad].
        mu: coefficient of friction: the largest our law reaches.
        gravity: (3,) [m/s^2].
        height: of the ground [m].
        kp: (n,) servo stiffness [N m/rad].
        kd: (n,) servo damping that is not in the joints [N m s/rad].
        limit: (n,) largest servo torque [N m]; inf where there is none.
    """

    task: Task
    urdf: str = field(repr=False)
    set_points: Array = field(repr=False)
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
            task=task, urdf=engine_urdf(scene.robot, damping), set_points=set_points(task),
            mu=scene.contact.friction.limit, gravity=np.array(scene.gravity),
            height=scene.terrain.height, kp=kp, kd=kd,
            limit=np.array(scene.robot.effort_limit) if servo.limited else np.full(n, np.inf),
        )  # fmt: skip

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of `set_points`."""
        return self.task.scene.robot.joint_names

    @property
    def drives(self) -> JointDrives:
        """Servos and damping, as divided between them here."""
        robot, servo = self.task.scene.robot, self.task.scene.servos
        damping = np.array(robot.damping) + (servo.gains(robot)[1] - self.kd)
        own = JointDrives.of(robot, servo)
        return own._replace(kp=self.kp, kd=self.kd, limit=self.limit, damping=damping)


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


# One URDF for all other engines: the bodies of our model, no fixed joints, foot spheres only.

ROOT = "root_joint"
BASE = "trunk"


def engine_urdf(robot: Robot, damping: Array) -> str:
    """Return the robot's URDF for another engine.

    Written from the model that we integrate, so that what is fixed together is one link: MuJoCo's
    parser needs no fusing, Drake's no weld, PyBullet's no massless link (it would give it 1 kg).

    Args:
        robot: revolute joints only, feet with a radius.
        damping: (n,) viscous damping of the joints, `joint_names` order [N m s/rad].

    Raises:
        ParameterError: a joint that is not revolute, or a point foot.
    """
    model = robot.model
    parts = [_link(robot, BASE, model.inertias[model.getJointId(ROOT)], ROOT)]
    for name, friction in zip(robot.joint_names, damping, strict=True):
        index = model.getJointId(name)
        parts.append(_link(robot, link_name(name), model.inertias[index], name))
        parts.append(_joint(model, index, name, float(friction)))
    body = "".join(parts)
    return f'<?xml version="1.0"?>\n<robot name="{robot.name}">\n{body}</robot>\n'


def link_name(joint: str) -> str:
    """Return the name of the link that a joint moves."""
    return BASE if joint == ROOT else f"{joint}_link"


def _link(robot: Robot, name: str, inertia: Any, joint: str) -> str:
    """Return a body with the spheres of the feet it carries."""
    parts = [xml.inertial(float(inertia.mass), tuple(inertia.lever), inertia.inertia.tolist())]
    for foot in robot.feet:
        if foot.joint == joint:
            if foot.radius <= 0.0:
                raise ParameterError(
                    f"radius of {foot.name}", foot.radius, "above 0 m: other engines have spheres"
                )
            centre = (float(foot.offset[0]), float(foot.offset[1]), float(foot.offset[2]))
            parts.append(xml.collision(Shape("sphere", (foot.radius,), centre)))
    return xml.link(name, parts)


def _joint(model: Any, index: int, name: str, damping: float) -> str:
    """Return a revolute joint with the placement and axis of our model."""
    import pinocchio as pin

    column = np.array(model.createData().joints[index].S, dtype=float).reshape(6, -1)
    if column.shape[1] != 1 or np.abs(column[:3]).max() > 0.0:
        raise ParameterError(f"joint {name}", str(model.joints[index]), "revolute")
    place = model.jointPlacements[index]
    parent = link_name(model.names[model.parents[index]])
    rpy = xml.numbers(pin.rpy.matrixToRpy(place.rotation).tolist())
    return (
        f'  <joint name="{name}" type="continuous">\n'
        f'    <parent link="{parent}"/><child link="{link_name(name)}"/>\n'
        f'    <origin xyz="{xml.numbers(place.translation.tolist())}" rpy="{rpy}"/>\n'
        f'    <axis xyz="{xml.numbers(column[3:, 0].tolist())}"/>\n'
        f'    <limit effort="1000" velocity="1000"/>\n'
        f'    <dynamics damping="{xml.number(damping)}" friction="0"/>\n  </joint>\n'
    )


# The other engines as entries: those installed, and each method's own reference.

ENGINES = {
    "mujoco": ("MuJoCo", "mujoco_engine", "Mujoco"),
    "pydrake": ("Drake", "drake_engine", "Drake"),
    "pybullet": ("PyBullet", "pybullet_engine", "Pybullet"),
}
"""Module that must be there -> name, adapter, class."""

LAW = (
    "The contact laws differ: ours is the scene's compliant foot, each other engine has its own. "
    "So a ratio compares what this robot's motion costs, not the solving of the same equations."
)


@dataclass(frozen=True)
class EngineEntry:
    """A method of another engine at one setting."""

    source: Engine
    method: str
    kind: str
    value: float
    reference: ReferenceSolution

    @property
    def engine(self) -> str:
        """Name of the engine."""
        return self.source.name

    @property
    def setting(self) -> str:
        """Its step or accuracy as text."""
        return setting_text(self.kind, self.value)

    def run(self) -> RunOutcome:
        """Run the task."""
        return self.source.run(self.method, self.kind, self.value)


@dataclass
class EngineEntries:
    """The entries of all other engines, and what there is to say about them.

    Attributes:
        entries: methods at their settings.
        notes: one line per engine: its law, or why it is not there.
    """

    entries: list[EngineEntry] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def engine_entries(
    task: Task, *, quick: bool, progress: Callable[[float], None] | None = None
) -> EngineEntries:
    """Return every installed engine's methods on a task with held set-points.

    Runs the references: each method has its engine's own, with a step at most a tenth of the
    finest one compared.

    Args:
        task: from `held_task`.
        quick: fewer and coarser settings, coarser references.
        progress: called with the finished fraction of the references.
    """
    found = EngineEntries()
    try:
        problem = Problem.of(task)
    except ParameterError as error:
        found.notes.append(f"no other engines on {task.name}: {error}")
        return found
    engines = []
    for module, (name, adapter, kind) in ENGINES.items():
        if find_spec(module) is None:
            found.notes.append(f"{name}: not installed (pip install {name.lower()})")
            continue
        maker = getattr(import_module(f"hexapod_pin.benchmark.engines.{adapter}"), kind)
        engines.append(cast(Engine, maker(problem)))
    found.notes += [f"{engine.name}: {engine.law}" for engine in engines]
    sweeps = [(engine, one) for engine in engines for one in engine.sweeps(quick=quick)]
    references: dict[tuple[str, tuple[str, str, float]], ReferenceSolution | str] = {}
    for k, (engine, one) in enumerate(sweeps):
        key = (engine.name, one.reference)
        reference = references[key] if key in references else _truth(engine, one)
        references[key] = reference
        if isinstance(reference, ReferenceSolution):
            found.entries += [
                EngineEntry(engine, one.method, one.kind, value, reference) for value in one.values
            ]
        else:
            found.notes.append(f"{engine.name} {one.method}: no reference, {reference}")
        if progress is not None:
            progress((k + 1) / len(sweeps))
    return found


def _truth(engine: Engine, one: EngineSweep) -> ReferenceSolution | str:
    """Return the reference of a method, or why there is none."""
    outcome = engine.run(*one.reference, exact=True)
    check = engine.run(*one.check, exact=True)
    for run in (outcome, check):
        if not run.ended:
            return run.note
    texts = [
        f"{engine.name} {method}, {setting_text(kind, value)}"
        for method, kind, value in (one.reference, one.check)
    ]
    return ReferenceSolution(outcome, texts[0], outcome.distance(check), texts[1])
