"""A sweep on the command line: its files, its progress, and what it comes to in a few lines."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hexapod_pin.commands.output_files import writable, writable_figure, written_files
from hexapod_pin.commands.progress import time_left_bar
from hexapod_pin.commands.terminal import echo

if TYPE_CHECKING:
    from hexapod_pin.sweep.runs import SweepResult
    from hexapod_pin.sweep.study import SweepStudy

SHOWN = 3
"""Failed cases whose reasons are printed."""


@dataclass(frozen=True)
class SweepFiles:
    """What a sweep writes.

    Attributes:
        store: keeps the cases.
        out: the dataset; None: none.
        plot: the figure; None: none.
    """

    store: Path
    out: Path | None
    plot: Path | None

    @classmethod
    def checked(
        cls, study: Path, *, store: Path | None, out: Path | None, plot: Path | None
    ) -> SweepFiles:
        """Return the files, refused now rather than after the sweep.

        Raises:
            TraceFileError, FileConflictError, MissingPackageError: as of `writable`.
        """
        from hexapod_pin.sweep.runs.sweep_result import ENDINGS

        return cls(
            writable("--store", Path(f"{study.stem}.db") if store is None else store),
            None if out is None else writable("--out", out, ENDINGS),
            None if plot is None else writable_figure("--plot", plot),
        )


def run_and_report(study: SweepStudy, files: SweepFiles, **how: Any) -> None:
    """Run a study with its progress on stderr, write its files and print what it came to.

    Raises:
        SweepInterrupted, StoreFullError, ...: as of `run_sweep`.
    """
    from hexapod_pin.sweep.runs import run_sweep

    echo(f"{study.name}: {len(study)} cases, study {study.digest}")
    for item in study.inputs:
        echo(f"  {item.name}{f' [{item.unit}]' if item.unit else ''}: {item.text}")
    begin = time.perf_counter()
    with time_left_bar("sweeping") as bar:
        result = run_sweep(study, files.store, progress=bar, **how)
    _print(result, time.perf_counter() - begin, bar.moved * len(result))
    out, plot = files.out, files.plot
    with written_files() as written:
        if out is not None:
            written(lambda: result.save(out))
        if plot is not None and result.done:
            from hexapod_pin.view.sweep_figure import write_sweep_figure

            written(lambda: write_sweep_figure(result, plot))


def _print(result: SweepResult, taken: float, run_now: float) -> None:
    """Print how many cases came to what, how long they took and where they are."""
    failed = result.failed
    echo(f"{result.done} of {len(result)} cases done, {len(failed)} failed")
    for kind, count in result.reasons.items():
        echo(f"  {count} x {kind}")
    for index, reason in failed[:SHOWN]:
        echo(f"  case {index}: {reason}")
    if len(failed) > SHOWN:
        echo(f"  ... {len(failed) - SHOWN} more: see `reason` in the dataset")
    if result.not_walking:
        echo(f"{result.not_walking} cases do not walk as planned: see `verdict`")
    if round(run_now):
        echo(f"{round(run_now)} cases run in {taken:.1f} s, {taken / run_now:.3g} s a case")
    echo(f"store: {result.path}")
