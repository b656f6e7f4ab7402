"""One scene measured: its references, its rows, and notes on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from hexapod_pin.benchmark.work_precision.measure import (
    BenchmarkRow,
    Entry,
    ReferenceSolution,
    measure,
    ratios,
)
from hexapod_pin.benchmark.work_precision.own_entry import (
    OwnEntry,
    find_reference,
    kept_settings,
    known_answer,
    sweep_settings,
)
from hexapod_pin.benchmark.work_precision.scenes import SceneOptions, as_typed
from hexapod_pin.benchmark.work_precision.task import Task, held_task
from hexapod_pin.errors import ParameterError
from hexapod_pin.validation.solver_setting import method_names

ROUNDS = 5
Progress = Callable[[float], None]


MOST_ROUNDS = 1000
"""Most timed rounds."""


@dataclass(frozen=True)
class ComparisonSettings:
    """What to measure.

    Attributes:
        names: our methods; None for all.
        rounds: timed rounds.
        quick: fewer settings.
        engines: whether other engines take part.
    """

    names: Sequence[str] | None = None
    rounds: int = ROUNDS
    quick: bool = False
    engines: bool = False

    def check(self) -> None:
        """Refuse what cannot be measured.

        Raises:
            ParameterError, UnknownNameError: no rounds, or a method that does not exist.
        """
        if not 1 <= self.rounds <= MOST_ROUNDS:
            raise ParameterError("--rounds", self.rounds, f"from 1 to {MOST_ROUNDS}")
        method_names(self.names)


@dataclass(frozen=True)
class Comparison:
    """The result for one scene.

    Attributes:
        task: what was run.
        references: the references used, ours first.
        rows: one per entry.
        notes: on the rows.
        interrupted: whether Ctrl-C cut it short.
    """

    task: Task
    references: tuple[ReferenceSolution, ...]
    rows: tuple[BenchmarkRow, ...]
    notes: tuple[str, ...] = field(default=())
    interrupted: bool = False

    @property
    def missed(self) -> list[BenchmarkRow]:
        """The rows that missed their requested accuracy."""
        return [row for row in self.rows if row.missed]

    @property
    def ratios(self) -> list[str]:
        """Our wall time over each other engine's best, one line each."""
        return ratios(self.rows)


def command_text(
    scenes: Sequence[str], options: SceneOptions, plan: ComparisonSettings, accuracy: float | None
) -> str:
    """Return the command of a comparison, or of advice where an accuracy is given [m, rad]."""
    return (
        f"hexapod-pin bench {' '.join(scenes)}{as_typed(options)}"
        + ("" if plan.names is None else f" --methods {','.join(plan.names)}")
        + ("" if accuracy is not None else f" --rounds {plan.rounds}")
        + (" --quick" if plan.quick else "")
        + (" --engines" if plan.engines else "")
        + ("" if accuracy is None else f" --advise {accuracy:g}")
    )


def compare(task: Task, plan: ComparisonSettings, progress: Progress | None = None) -> Comparison:
    """Measure a task.

    Args:
        task: what to run; with other engines its set-points are held from sample to sample.
        plan: what to measure.
        progress: called with the finished fraction.

    Raises:
        NoReferenceError: nothing to compare with.
        UnknownNameError: a method that does not exist.
    """
    names = method_names(plan.names)
    problem = held_task(task) if plan.engines else task
    notes = [] if problem is task else [f"set-points held for {task.sample * 1e3:g} ms"]
    reference = find_reference(problem)
    _answer_note(problem, reference, notes)
    single = [
        setting for name in names for setting in sweep_settings(problem, name, quick=plan.quick)
    ]
    entries: list[Entry] = [
        OwnEntry(problem, setting, reference)
        for setting in single + kept_settings(problem, names, quick=plan.quick)
        if str(setting) != reference.text  # no run is compared with itself
    ]
    if plan.engines:
        _stops_note(problem, reference, notes)
        entries += _others(problem, plan, notes, progress)
    found = measure(entries, problem.duration, plan.rounds, _later(progress, plan.engines))
    references = tuple(dict.fromkeys([reference, *(one.reference for one in entries)]))
    return Comparison(problem, references, found.rows, tuple(notes), found.interrupted)


def _others(
    task: Task, plan: ComparisonSettings, notes: list[str], progress: Progress | None
) -> Sequence[Entry]:
    """Return the other engines' entries; remarks are added to `notes`."""
    from hexapod_pin.benchmark.engines.engine import LAW, engine_entries

    found = engine_entries(task, quick=plan.quick, progress=_first(progress))
    if found.entries:
        notes.append(LAW)
    notes += found.notes
    return found.entries


def _stops_note(task: Task, reference: ReferenceSolution, notes: list[str]) -> None:
    """Note where the comparison has joint stops on one side only."""
    robot, q = task.scene.robot, reference.outcome.q
    if q is not None and ((q[:, 7:] < robot.lower) | (q[:, 7:] > robot.upper)).any():
        notes.append("a joint passes its limit: our stops hold it, other engines have none here")


def _answer_note(task: Task, reference: ReferenceSolution, notes: list[str]) -> None:
    distance = known_answer(task, reference)
    if distance is not None:
        notes.append(f"the reference is {distance:.1e} from the hard case's published end state")


def _first(progress: Progress | None) -> Progress | None:
    """Map onto the first half of a bar."""
    return None if progress is None else lambda fraction: progress(0.5 * fraction)


def _later(progress: Progress | None, engines: bool) -> Progress | None:
    """Map onto the second half of a bar, where the first is taken by references."""
    if progress is None or not engines:
        return progress
    return lambda fraction: progress(0.5 + 0.5 * fraction)
