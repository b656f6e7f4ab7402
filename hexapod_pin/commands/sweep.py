"""The command `sweep` runs the cases of a study and stores each when it is finished."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hexapod_pin.commands.options import ImportCode, OptionalPath, import_code
from hexapod_pin.commands.output_files import (
    PAGES,
    report_marks,
    writable,
    writable_figure,
    written_files,
)
from hexapod_pin.commands.progress import time_left_bar
from hexapod_pin.commands.study_options import (
    Processes,
    Resume,
    RetryFailed,
    Scheduler,
    StudyThreads,
)
from hexapod_pin.commands.terminal import announce, echo

if TYPE_CHECKING:
    from hexapod_pin.study.runs import SweepResult


def sweep(
    study: Annotated[Path, typer.Argument(help="A study file (study.toml).")],
    store: Annotated[
        OptionalPath,
        typer.Option(help="SQLite file that keeps every finished case; default: STUDY.db."),
    ] = None,
    out: Annotated[
        OptionalPath, typer.Option(help="Dataset to write: .nc, .h5, .hdf5, or .csv as a table.")
    ] = None,
    plot: Annotated[OptionalPath, typer.Option(help="Figure to write: .png, .svg or .pdf.")] = None,
    report: Annotated[
        OptionalPath,
        typer.Option(help="Report to write: .html with figure and sortable tables."),
    ] = None,
    resume: Resume = False,
    retry_failed: RetryFailed = False,
    threads: StudyThreads = None,
    processes: Processes = None,
    scheduler: Scheduler = None,
    chunk: Annotated[int, typer.Option(help="Cases that a worker is given at a time.")] = 4,
    code: ImportCode = None,
) -> None:
    """Run all cases of a study; what is finished is stored whatever happens."""
    announce(f"reading {study}")
    from hexapod_pin.study.runs import run_sweep
    from hexapod_pin.study.runs.sweep_result import ENDINGS
    from hexapod_pin.study.sweep import load_sweep

    store = writable("--store", Path(f"{study.stem}.db") if store is None else store)
    out = None if out is None else writable("--out", out, ENDINGS)
    plot = None if plot is None else writable_figure("--plot", plot)
    report = None if report is None else writable("--report", report, PAGES, drawn=True)
    import_code(code)
    found = load_sweep(study)
    echo(f"{found.name}: {len(found)} cases, study {found.digest}")
    for item in found.inputs:
        echo(f"  {item.name}{f' [{item.unit}]' if item.unit else ''}: {item.text}")
    begin = time.perf_counter()
    with time_left_bar("sweeping") as bar:
        result = run_sweep(
            found, store, threads=threads, processes=processes, scheduler=scheduler, chunk=chunk,
            resume=resume, retry_failed=retry_failed, progress=bar,
        )  # fmt: skip
    _print(result, time.perf_counter() - begin, bar.moved * len(result))
    with written_files() as written:
        if out is not None:
            written(lambda: result.save(out))
        if plot is not None and result.done:
            from hexapod_pin.view.study_figures import write_sweep_figure

            written(lambda: write_sweep_figure(result, plot))
        if report is not None:
            from hexapod_pin.view.study_report import write_study_report

            written(lambda: write_study_report(result, report, **report_marks()))


SHOWN = 3
"""Failed cases whose reasons are printed."""


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
