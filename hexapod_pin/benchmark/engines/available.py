"""The other engines as entries: who is installed, and each method's own reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from typing import cast

from hexapod_pin.benchmark.engines.engine import Engine, EngineSweep, Problem
from hexapod_pin.benchmark.work_precision.entry import ReferenceSolution, RunOutcome
from hexapod_pin.benchmark.work_precision.task import Task
from hexapod_pin.errors import ParameterError
from hexapod_pin.validation.solver_setting import setting_text

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
        """Its step or accuracy, in words."""
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
