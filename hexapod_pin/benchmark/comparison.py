"""One scene measured: its references, its rows, and what must be said with them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from hexapod_pin.benchmark.entry import Contender, Truth
from hexapod_pin.benchmark.measure import Row, measure
from hexapod_pin.benchmark.reference_solution import known_answer, reference
from hexapod_pin.benchmark.settings import Own, ladder, methods
from hexapod_pin.benchmark.task import Task, held_task
from hexapod_pin.benchmark.tolerance_sweep import ratios

ROUNDS = 5
QUICK_ROUNDS = 3
Progress = Callable[[float], None]


@dataclass(frozen=True)
class ComparisonSettings:
    """What to measure.

    Attributes:
        names: our methods; None for all.
        rounds: timed rounds.
        quick: fewer settings.
        peers: whether other engines take part.
    """

    names: Sequence[str] | None = None
    rounds: int = ROUNDS
    quick: bool = False
    peers: bool = False


@dataclass(frozen=True)
class Comparison:
    """The result for one scene.

    Attributes:
        task: what was run.
        truths: the references used, ours first.
        rows: one per contender.
        notes: what must be said with the rows.
        interrupted: whether Ctrl-C cut it short.
    """

    task: Task
    truths: tuple[Truth, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = field(default=())
    interrupted: bool = False

    @property
    def ratios(self) -> list[str]:
        """Our wall time over each other engine's best, one line each."""
        return ratios(self.rows)


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
    names = methods(plan.names)
    problem = held_task(task) if plan.peers else task
    notes = [] if problem is task else [f"set-points held for {task.sample * 1e3:g} ms"]
    truth = reference(problem)
    _answer_note(problem, truth, notes)
    contenders: list[Contender] = [
        Own(problem, setting, truth)
        for name in names
        for setting in ladder(problem, name, quick=plan.quick)
        if str(setting) != truth.text  # no run is compared with itself
    ]
    if plan.peers:
        _stops_note(problem, truth, notes)
        contenders += _others(problem, plan, notes, progress)
    found = measure(contenders, problem.duration, plan.rounds, _later(progress, plan.peers))
    truths = tuple(dict.fromkeys([truth, *(one.truth for one in contenders)]))
    return Comparison(problem, truths, found.rows, tuple(notes), found.interrupted)


def _others(
    task: Task, plan: ComparisonSettings, notes: list[str], progress: Progress | None
) -> Sequence[Contender]:
    """Return the other engines' contenders; says in `notes` what there is to say."""
    from hexapod_pin.benchmark.engines.available import LAW, rivals

    found = rivals(task, quick=plan.quick, progress=_first(progress))
    if found.contenders:
        notes.append(LAW)
    notes += found.notes
    return found.contenders


def _stops_note(task: Task, truth: Truth, notes: list[str]) -> None:
    """Say where the comparison has joint stops on one side only."""
    robot, q = task.scene.robot, truth.outcome.q
    if q is not None and ((q[:, 7:] < robot.lower) | (q[:, 7:] > robot.upper)).any():
        notes.append("a joint passes its limit: our stops hold it, other engines have none here")


def _answer_note(task: Task, truth: Truth, notes: list[str]) -> None:
    distance = known_answer(task, truth)
    if distance is not None:
        notes.append(f"the reference is {distance:.1e} from the hard case's published end state")


def _first(progress: Progress | None) -> Progress | None:
    """Map onto the first half of a bar."""
    return None if progress is None else lambda fraction: progress(0.5 * fraction)


def _later(progress: Progress | None, peers: bool) -> Progress | None:
    """Map onto the second half of a bar, where the first is taken by references."""
    if progress is None or not peers:
        return progress
    return lambda fraction: progress(0.5 + 0.5 * fraction)
