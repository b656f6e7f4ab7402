"""Which method and setting reach a wanted accuracy at least cost, measured on the user's scene."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from hexapod_pin.benchmark.work_precision.comparison import Comparison
from hexapod_pin.benchmark.work_precision.measure import (
    BenchmarkRow,
    ReferenceSolution,
    cheapest,
    measure,
    sweeps,
)
from hexapod_pin.benchmark.work_precision.own_entry import STEPS, OwnEntry, find_reference, run_task
from hexapod_pin.benchmark.work_precision.task import Task, standing_task
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.simulation.methods import METHODS
from hexapod_pin.text_table import Table
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import SolverSetting, divides, method_names

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene

PROBE_DURATION = 0.5
"""Length of the measured piece where none is given [s]."""

PROBE_SAMPLE = 0.01
"""Time between compared samples of the piece [s]."""

SAFETY_FACTOR = 3.0
"""An accepted setting was this factor better than wanted, on the piece."""

ACCURACY_RATIOS = (10.0, 3.0, 1.0, 0.3, 0.1, 0.03)
"""Accuracies tried, as multiples of the wanted one."""

CONFIRMING_SETTINGS = 2
"""A method is not tried any tighter than this many settings beyond the first that is accepted."""

MAX_WALL_RATIO = 3.0
"""A method is given up at this multiple of the cheapest accepted wall time: tighter costs more."""

ROUNDS = 3


class NoAdviceError(HexapodError):
    """No method reached the wanted accuracy on the piece."""


@dataclass(frozen=True)
class Advice:
    """What to ask `simulate` for.

    Attributes:
        method: the cheapest method that was good enough.
        accuracy: to ask it for [m, rad]; None for a fixed step.
        step: to ask it for [s]; None for an adaptive method.
        predicted_error: its largest error on the piece [m, rad].
        evaluations: of the dynamics per simulated second.
        milliseconds: wall time per simulated second [ms], on this machine.
        sure: "high", "fair" or "low".
        reasons: why not surer; empty with "high".
        wanted: the requested accuracy [m, rad].
        piece: what was measured, with its reference.
        reference: that reference.
        tried: one row per setting tried.
    """

    method: str
    accuracy: float | None
    step: float | None
    predicted_error: float
    evaluations: float
    milliseconds: float
    sure: Literal["high", "fair", "low"]
    reasons: tuple[str, ...]
    wanted: float
    piece: Task = field(repr=False)
    reference: ReferenceSolution = field(repr=False)
    tried: tuple[BenchmarkRow, ...] = field(repr=False)

    @property
    def settings(self) -> dict[str, Any]:
        """Return what to give to `simulate`: method, and accuracy or step."""
        return SolverSetting(self.method, self.accuracy or self.step or 0.0).arguments

    def __str__(self) -> str:
        """Return the advice as text."""
        number = f"step={self.step:g}" if self.step else f"accuracy={self.accuracy:.2g}"
        why = f" ({'; '.join(self.reasons)})" if self.reasons else ""
        return (
            f'for an error of {self.wanted:g}: method="{self.method}", {number}; error '
            f"{self.predicted_error:.1e} over {self.piece.duration:g} s, "
            f"{self.milliseconds:.3g} ms and {self.evaluations:.0f} evaluations per simulated "
            f"second; how sure: {self.sure}{why}"
        )

    def table(self) -> str:
        """Return everything that was tried as text, one line each."""
        rows = [
            (row.method, row.setting, f"{row.error:.1e}", f"{row.wall * 1e3:.3g}",
             "-" if row.evaluations is None else f"{row.evaluations:.0f}", row.note)
            for row in self.tried
        ]  # fmt: skip
        head = ("method", "setting", "error", "ms/s", "evaluations/s", "")
        return "\n".join(Table("", head, rows, "<<>>><", rule=False).lines())


def advise(
    scene: Scene,
    controller: Controller,
    accuracy: float,
    *,
    piece: float = PROBE_DURATION,
    initial: State | None = None,
) -> Advice:
    """Measure all methods on a short piece of a scene and recommend one.

    Errors are measured against a tight reference on that piece. Accepted is a setting whose
    error, `SAFETY_FACTOR` times over, stays within the wanted one, and with it every tighter
    setting tried of that method; recommended is the one with the least wall time.

    Args:
        scene: robot, ground, contact, servos.
        controller: as given to `simulate`.
        accuracy: wanted error of every position at every sample [m, rad].
        piece: simulated time to measure on [s], from the start; whole hundredths of a second. It
            should hold what makes the run hard: touch-down, a step of the gait.
        initial: state at t = 0; default standing at the controller's first set-point.

    Raises:
        ParameterError: accuracy or piece out of range.
        NoAdviceError: no method is good enough; the message names the nearest.
        NoReferenceError: there is nothing to compare with.
        GaitError, ReachError, StateError: as in `simulate`.
    """
    if not 1e-8 <= accuracy <= 0.1:
        raise ParameterError("accuracy", accuracy, "1e-8 to 0.1 m and rad")
    task = standing_task(
        "piece", scene, controller, duration=piece, sample=PROBE_SAMPLE, initial=initial,
        about=f"first {piece:g} s",
    )  # fmt: skip
    return advise_on(task, accuracy)


def advise_on(task: Task, accuracy: float) -> Advice:
    """Return the advice for a task as it is; see `advise`."""
    reference = find_reference(task)
    entries = [
        OwnEntry(task, setting, reference) for setting in _worth_timing(task, reference, accuracy)
    ]
    found = measure(entries, task.duration, ROUNDS)
    best = _choose(found.rows, accuracy)
    if best is None:
        nearest = min((row.error for row in found.rows if row.ended), default=float("nan"))
        raise NoAdviceError(
            f"no method had an error below {accuracy / SAFETY_FACTOR:.1e} on the first "
            f"{task.duration:g} s; the best was {nearest:.1e}. Ask for less."
        )
    setting = SolverSetting(best.method, best.value)
    reasons, sure = _sureness(task, reference, best, found.rows, accuracy)
    return Advice(
        method=best.method,
        accuracy=best.value if setting.adaptive else None,
        step=None if setting.adaptive else best.value,
        predicted_error=best.error,
        evaluations=float(best.evaluations or 0.0),
        milliseconds=best.wall * 1e3,
        sure=sure, reasons=reasons, wanted=accuracy, piece=task, reference=reference,
        tried=found.rows,
    )  # fmt: skip


def _worth_timing(task: Task, reference: ReferenceSolution, accuracy: float) -> list[SolverSetting]:
    """Return the settings to time: of each method, the loosest first, until one is of no use."""
    found: list[SolverSetting] = []
    best = float("inf")
    for method in method_names():
        accepted = 0
        for setting in _settings(task, method, accuracy):
            if str(setting) == reference.text:
                break
            outcome = run_task(task, setting)
            found.append(setting)
            good = outcome.distance(reference.outcome).q * SAFETY_FACTOR <= accuracy
            accepted = accepted + 1 if good else 0
            best = min(best, outcome.wall) if good else best
            if accepted > CONFIRMING_SETTINGS or outcome.wall > MAX_WALL_RATIO * best:
                break
    return found


def _settings(task: Task, method: str, accuracy: float) -> Iterator[SolverSetting]:
    """Yield the settings of a method around the wanted accuracy, loosest first."""
    found = METHODS[method]
    if found.adaptive:
        values = (float(f"{share * accuracy:.1e}") for share in ACCURACY_RATIOS)
        yield from (
            SolverSetting(method, x) for x in values if found.tightest <= x <= found.loosest
        )
    else:
        yield from (SolverSetting(method, step) for step in STEPS if divides(step, task.sample))


def _choose(rows: tuple[BenchmarkRow, ...], accuracy: float) -> BenchmarkRow | None:
    """Return the cheapest row that, with its tighter ones, is `SAFETY_FACTOR` times better."""
    found = [cheapest(own, accuracy / SAFETY_FACTOR) for own in sweeps(rows).values()]
    return min((row for row in found if row is not None), key=lambda row: row.wall, default=None)


def _sureness(
    task: Task,
    reference: ReferenceSolution,
    best: BenchmarkRow,
    rows: tuple[BenchmarkRow, ...],
    accuracy: float,
) -> tuple[tuple[str, ...], Literal["high", "fair", "low"]]:
    """Return what speaks against the advice, and how sure that leaves it."""
    reasons = []
    if reference.uncertainty.q > 0.1 * accuracy:
        reasons.append(f"the reference itself is certain to {reference.uncertainty.q:.1e} only")
    tighter = [row for row in rows if row.method == best.method and row.value < best.value]
    if len(tighter) < CONFIRMING_SETTINGS:
        reasons.append(f"tighter settings that confirm it: only {len(tighter)}")
    if not reference.outcome.touches:
        reasons.append("no foot touched down or lifted off in the piece: take a longer one")
    growth = _growth(task, reference, best)
    if growth > 2.0:
        reasons.append(f"the error grew {growth:.1f} times in the second half of the piece")
    if reference.uncertainty.q > accuracy / SAFETY_FACTOR or len(reasons) > 1:
        return tuple(reasons), "low"
    return tuple(reasons), "fair" if reasons else "high"


def _growth(task: Task, reference: ReferenceSolution, best: BenchmarkRow) -> float:
    """Return the error over the whole piece, relative to that over its first half."""
    outcome = run_task(task, SolverSetting(best.method, best.value))
    if outcome.q is None or reference.outcome.q is None or task.samples < 4:
        return 1.0
    half = task.samples // 2 + 1
    first = PositionError.between(outcome.q[:half], reference.outcome.q[:half]).q
    return outcome.distance(reference.outcome).q / max(first, 1e-15)


def advice_comparison(task: Task, accuracy: float) -> Comparison:
    """Return what was tried for an advice, with the advice among the notes."""
    advice = advise_on(task, accuracy)
    return Comparison(task, (advice.reference,), advice.tried, (str(advice),))
