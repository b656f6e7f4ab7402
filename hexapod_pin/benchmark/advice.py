"""Which method and setting reach a wanted accuracy at least cost, measured on the user's scene."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from hexapod_pin.benchmark.entry import Truth
from hexapod_pin.benchmark.error import Distance
from hexapod_pin.benchmark.measure import Row, measure
from hexapod_pin.benchmark.reference_solution import reference
from hexapod_pin.benchmark.settings import STEPS, Own, Setting, divides, methods, run_ours
from hexapod_pin.benchmark.task import Task, standing_task
from hexapod_pin.benchmark.tolerance_sweep import cheapest, ladders
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.simulation.methods import METHODS

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.robot.state import State
    from hexapod_pin.simulation.scene import Scene

PIECE = 0.5
"""Length of the measured piece where none is given [s]."""

SAMPLE = 0.01
"""Time between compared samples of the piece [s]."""

SAFETY = 3.0
"""An accepted setting was this factor better than wanted, on the piece."""

SHARES = (10.0, 3.0, 1.0, 0.3, 0.1, 0.03)
"""Accuracies tried, as multiples of the wanted one."""

CONFIRM = 2
"""A method is not tried any tighter than this many settings beyond the first that is accepted."""

HOPELESS = 3.0
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
        wanted: the accuracy asked for [m, rad].
        piece: what was measured, with its reference.
        truth: that reference.
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
    truth: Truth = field(repr=False)
    tried: tuple[Row, ...] = field(repr=False)

    @property
    def settings(self) -> dict[str, Any]:
        """Return what to give to `simulate`: method, and accuracy or step."""
        return Setting(self.method, self.accuracy or self.step or 0.0).arguments

    def __str__(self) -> str:
        """Return the advice in words."""
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
        lines = [f"{'method':16}{'setting':18}{'error':>10}{'ms/s':>10}{'evaluations/s':>15}"]
        for row in self.tried:
            count = "-" if row.evaluations is None else f"{row.evaluations:.0f}"
            lines.append(
                f"{row.method:16}{row.setting:18}{row.error:10.1e}{row.wall * 1e3:10.3g}"
                f"{count:>15}  {row.note}".rstrip()
            )
        return "\n".join(lines)


def advise(
    scene: Scene,
    controller: Controller,
    accuracy: float,
    *,
    piece: float = PIECE,
    initial: State | None = None,
) -> Advice:
    """Measure all methods on a short piece of a scene and recommend one.

    Errors are measured against a tight reference on that piece. Accepted is a setting whose
    error, `SAFETY` times over, stays within the wanted one, and with it every tighter setting
    tried of that method; recommended is the one with the least wall time.

    Args:
        scene: robot, ground, contact, servos.
        controller: as given to `simulate`.
        accuracy: wanted error of every position at every sample [m, rad].
        piece: simulated time to measure on [s], from the start; whole hundredths of a second. It
            should hold what makes the run hard: touch-down, a step of the gait.
        initial: state at t = 0; default standing at the controller's first set-point.

    Raises:
        ParameterError: accuracy or piece out of range.
        NoAdviceError: no method is good enough; says what came nearest.
        NoReferenceError: there is nothing to compare with.
        GaitError, ReachError, StateError: as in `simulate`.
    """
    if not 1e-8 <= accuracy <= 0.1:
        raise ParameterError("accuracy", accuracy, "1e-8 to 0.1 m and rad")
    task = standing_task(
        "piece", scene, controller, duration=piece, sample=SAMPLE, initial=initial,
        about=f"first {piece:g} s",
    )  # fmt: skip
    return advise_on(task, accuracy)


def advise_on(task: Task, accuracy: float) -> Advice:
    """Return the advice for a task as it is; see `advise`."""
    truth = reference(task)
    contenders = [Own(task, setting, truth) for setting in _worth_timing(task, truth, accuracy)]
    found = measure(contenders, task.duration, ROUNDS)
    best = _choose(found.rows, accuracy)
    if best is None:
        nearest = min((row.error for row in found.rows if row.ended), default=float("nan"))
        raise NoAdviceError(
            f"no method had an error below {accuracy / SAFETY:.1e} on the first "
            f"{task.duration:g} s; the best was {nearest:.1e}. Ask for less."
        )
    setting = Setting(best.method, best.value)
    reasons, sure = _sureness(task, truth, best, found.rows, accuracy)
    return Advice(
        method=best.method,
        accuracy=best.value if setting.adaptive else None,
        step=None if setting.adaptive else best.value,
        predicted_error=best.error,
        evaluations=float(best.evaluations or 0.0),
        milliseconds=best.wall * 1e3,
        sure=sure, reasons=reasons, wanted=accuracy, piece=task, truth=truth, tried=found.rows,
    )  # fmt: skip


def _worth_timing(task: Task, truth: Truth, accuracy: float) -> list[Setting]:
    """Return the settings to time: each method from loose to tight, until it is of no use."""
    found: list[Setting] = []
    best = float("inf")
    for method in methods():
        accepted = 0
        for setting in _settings(task, method, accuracy):
            if str(setting) == truth.text:
                break
            outcome = run_ours(task, setting)
            found.append(setting)
            good = outcome.distance(truth.outcome).q * SAFETY <= accuracy
            accepted = accepted + 1 if good else 0
            best = min(best, outcome.wall) if good else best
            if accepted > CONFIRM or outcome.wall > HOPELESS * best:
                break
    return found


def _settings(task: Task, method: str, accuracy: float) -> Iterator[Setting]:
    """Yield the settings of a method around the wanted accuracy, loosest first."""
    found = METHODS[method]
    if found.adaptive:
        values = (float(f"{share * accuracy:.1e}") for share in SHARES)
        yield from (Setting(method, x) for x in values if found.tightest <= x <= found.loosest)
    else:
        yield from (Setting(method, step) for step in STEPS if divides(step, task.sample))


def _choose(rows: tuple[Row, ...], accuracy: float) -> Row | None:
    """Return the cheapest row that is `SAFETY` times better than wanted, its tighter ones too."""
    found = [cheapest(own, accuracy / SAFETY) for own in ladders(rows).values()]
    return min((row for row in found if row is not None), key=lambda row: row.wall, default=None)


def _sureness(
    task: Task, truth: Truth, best: Row, rows: tuple[Row, ...], accuracy: float
) -> tuple[tuple[str, ...], Literal["high", "fair", "low"]]:
    """Return what speaks against the advice, and how sure that leaves it."""
    reasons = []
    if truth.doubt.q > 0.1 * accuracy:
        reasons.append(f"the reference itself is certain to {truth.doubt.q:.1e} only")
    tighter = [row for row in rows if row.method == best.method and row.value < best.value]
    if len(tighter) < CONFIRM:
        reasons.append(f"tighter settings that confirm it: only {len(tighter)}")
    if not truth.outcome.touches:
        reasons.append("no foot touched down or lifted off in the piece: take a longer one")
    growth = _growth(task, truth, best)
    if growth > 2.0:
        reasons.append(f"the error grew {growth:.1f} times in the second half of the piece")
    if truth.doubt.q > accuracy / SAFETY or len(reasons) > 1:
        return tuple(reasons), "low"
    return tuple(reasons), "fair" if reasons else "high"


def _growth(task: Task, truth: Truth, best: Row) -> float:
    """Return the error over the whole piece, relative to that over its first half."""
    outcome = run_ours(task, Setting(best.method, best.value))
    if outcome.q is None or truth.outcome.q is None or task.samples < 4:
        return 1.0
    half = task.samples // 2 + 1
    first = Distance.between(outcome.q[:half], truth.outcome.q[:half]).q
    return outcome.distance(truth.outcome).q / max(first, 1e-15)
