"""The job of `hexapod-pin bench`: measure scenes or give advice, print, write, draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.benchmark.advice import advise_on
from hexapod_pin.benchmark.comparison import Comparison, ComparisonSettings, compare
from hexapod_pin.benchmark.figure import ENDINGS, write_plot
from hexapod_pin.benchmark.machine import Machine
from hexapod_pin.benchmark.report import WRITERS, Report, require_ending, write_report
from hexapod_pin.benchmark.scene_options import Wish, find_task, given
from hexapod_pin.benchmark.settings import methods
from hexapod_pin.benchmark.terminal import console, show
from hexapod_pin.commands.output_files import writable
from hexapod_pin.commands.progress import progress_bar
from hexapod_pin.errors import ParameterError, SimulationInterrupted

if TYPE_CHECKING:
    from rich.console import Console

    from hexapod_pin.benchmark.task import Task


@dataclass(frozen=True)
class Request:
    """What the command was asked for.

    Attributes:
        scenes: names of scenes or robots, paths of files.
        wish: what was said about the scene besides.
        plan: what to measure.
        advise: wanted accuracy [m, rad]; None to measure everything.
        out: report to write (.md, .csv, .json); None for none.
        plot: figure to write (.png, .svg, .pdf); None for none.
    """

    scenes: Sequence[str]
    wish: Wish
    plan: ComparisonSettings
    advise: float | None = None
    out: Path | None = None
    plot: Path | None = None

    @property
    def text(self) -> str:
        """The command that asks for this."""
        plan = self.plan
        return (
            f"hexapod-pin bench {' '.join(self.scenes)}{given(self.wish)}"
            + ("" if plan.names is None else f" --methods {','.join(plan.names)}")
            + ("" if self.advise is not None else f" --rounds {plan.rounds}")
            + (" --quick" if plan.quick else "")
            + (" --peers" if plan.peers else "")
            + ("" if self.advise is None else f" --advise {self.advise:g}")
        )


def bench(request: Request) -> None:
    """Measure, print, write and draw; what is done when Ctrl-C comes is printed and written too.

    Raises:
        ParameterError, UnknownNameError, TraceFileError: refused before anything is run.
        NoReferenceError, NoAdviceError: a scene that cannot be measured.
        SimulationInterrupted: Ctrl-C.
    """
    out, plot = _files(request)
    if request.plan.rounds < 1:
        raise ParameterError("--rounds", request.plan.rounds, "at least 1")
    methods(request.plan.names)
    tasks = [find_task(name, request.wish) for name in request.scenes]
    machine, screen = Machine.here(), console()
    screen.print(str(machine), markup=False, soft_wrap=True)
    done: list[Comparison] = []
    interrupted = False
    for task in tasks:
        try:
            done.append(_one(task, request, screen))
        except (KeyboardInterrupt, SimulationInterrupted):
            interrupted = True
        if interrupted or done[-1].interrupted:
            break
    if done:
        _write(Report(machine, request.text, done), out, plot, screen)
    if interrupted or done[-1].interrupted:
        raise SimulationInterrupted("interrupted; what was measured before is above", None)


def _files(request: Request) -> tuple[Path | None, Path | None]:
    """Return the files to write, refused now rather than after the measurement."""
    out, plot = request.out, request.plot
    if out is not None:
        require_ending("--out", out, tuple(WRITERS))
        out = writable("--out", out)
    if plot is not None:
        require_ending("--plot", plot, ENDINGS)
        plot = writable("--plot", plot)
        _require_matplotlib()
    return out, plot


def _require_matplotlib() -> None:
    from importlib.util import find_spec

    if find_spec("matplotlib") is None:
        raise ParameterError(
            "--plot", "given", "left out without matplotlib",
            "pip install 'hexapod-pin[plot]' brings it.",
        )  # fmt: skip


def _one(task: Task, request: Request, screen: Console) -> Comparison:
    """Measure one scene, or find the advice for it, and print it."""
    if request.advise is None:
        with progress_bar(f"measuring {task.name}") as progress:
            found = compare(task, request.plan, progress)
    else:
        found = _advice(task, request.advise)
    show(found, screen)
    return found


def _advice(task: Task, accuracy: float) -> Comparison:
    """Return what was tried for an advice, with the advice among the notes."""
    advice = advise_on(task, accuracy)
    return Comparison(task, (advice.truth,), advice.tried, (str(advice),))


def _write(report: Report, out: Path | None, plot: Path | None, screen: Console) -> None:
    if out is not None:
        screen.print(f"wrote {write_report(report, out)}", markup=False, soft_wrap=True)
    if plot is not None:
        screen.print(f"wrote {write_plot(report, plot)}", markup=False, soft_wrap=True)
