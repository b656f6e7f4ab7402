"""The command `sweep` runs the cases of a study and stores each when it is finished."""

from __future__ import annotations

import json as json_text
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hexapod_pin.commands.options import (
    AsJson,
    ImportCode,
    OptionalPath,
    OptionalText,
    comma_list,
    import_code,
)
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
from hexapod_pin.commands.terminal import FAILED, announce, echo, fail
from hexapod_pin.errors import ParameterError
from hexapod_pin.text_table import folded

if TYPE_CHECKING:
    from hexapod_pin.study.runs import SweepResult
    from hexapod_pin.study.sweep import SweepStudy


def sweep(
    study: Annotated[Path, typer.Argument(help="A study file (study.toml).")],
    store: Annotated[
        OptionalPath,
        typer.Option(
            help="SQLite file that keeps every finished case; default: the name of the study's "
            "file with .db, in the current folder."
        ),
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
    columns: Annotated[
        OptionalText,
        typer.Option(
            help="Of a .csv file: only these beside the inputs, separated by commas, such as "
            "walks,kind_torque_peak. Default: all."
        ),
    ] = None,
    full: Annotated[bool, typer.Option("--full", help="A line for every case.")] = False,
    json: AsJson = False,
    chunk: Annotated[int, typer.Option(help="Cases that a worker is given at a time.")] = 4,
    code: ImportCode = None,
) -> None:
    """Run all cases of a study; what is finished is stored whatever happens."""
    announce(f"reading {study}")
    from hexapod_pin.study.runs import run_sweep
    from hexapod_pin.study.runs.sweep_result import ENDINGS, require_columns
    from hexapod_pin.study.sweep import load_sweep

    store = writable("--store", Path(f"{study.stem}.db") if store is None else store)
    out = None if out is None else writable("--out", out, ENDINGS)
    plot = None if plot is None else writable_figure("--plot", plot)
    report = None if report is None else writable("--report", report, PAGES, drawn=True)
    import_code(code)
    found = load_sweep(study)
    if columns is not None and (out is None or out.suffix.lower() != ".csv"):
        raise ParameterError("--columns", columns, "given with --out FILE.csv")
    require_columns(comma_list(columns) or (), [{"name": item.name} for item in found.inputs])
    begin = time.perf_counter()
    with time_left_bar("sweeping") as bar:
        result = run_sweep(
            found, store, threads=threads, processes=processes, scheduler=scheduler, chunk=chunk,
            resume=resume, retry_failed=retry_failed, progress=bar,
        )  # fmt: skip
    taken, run_now = time.perf_counter() - begin, bar.moved * len(result)
    if json:
        echo(json_text.dumps(result.to_dict(), indent=2, allow_nan=False))
    else:
        _print(found, result, taken, run_now, full)
    with written_files() as written:
        if out is not None:
            written(lambda: result.save(out, comma_list(columns)))
        if plot is not None and result.done:
            from hexapod_pin.view.study_figures import write_sweep_figure

            written(lambda: write_sweep_figure(result, plot))
        if report is not None:
            from hexapod_pin.view.study_report import write_study_report

            written(lambda: write_study_report(result, report, **report_marks()))
    if result.failed and not result.done:
        fail(f"{result.name}: none of {len(result)} cases done", FAILED)


SHOWN = 2
"""Failed cases whose reasons are printed."""

ROWS = 10
"""Cases of the printed table, without --full."""


def _print(
    study: SweepStudy, result: SweepResult, taken: float, run_now: float, full: bool
) -> None:
    """Print how many cases came to what, a table of them, and where they are."""
    import numpy as np

    failed, text = result.failed, f"{result.name}: {result.done} of {len(result)} cases done"
    text += f", {len(failed)} failed" if failed else ""
    text += f", {result.not_walking} do not walk" if result.not_walking else ", all walk"
    if not result.done or np.isnan(result.columns["walks"].values).any():
        text = text.removesuffix(", all walk")
    if result.done and np.isnan(result.columns["measured_speed"].values).all():
        text += "; none has a whole steady cycle: give a longer duration"
    if failed and not result.done:
        text = f"{result.name}: none of {len(result)} cases done: {failed[0][1]}"
    _echo(text)
    rows = len(result) if full else ROWS
    if result.done:
        echo("\n".join(result.table(rows).lines()))
        if result.done > rows:
            _echo(
                f"* at a limit; the {rows} cases of largest torque of {result.done}; --full has all"
            )
    reasons = [f"{count} x {kind}" for kind, count in result.reasons.items()]
    first = 0 if result.done else 1  # the headline has that of the first
    reasons += [f"case {index}: {reason}" for index, reason in failed[first:SHOWN]]
    for line in reasons:
        _echo(line)
    timing = f"{round(run_now)} cases run in {taken:.1f} s; " if round(run_now) else ""
    further = "; next: --out FILE.csv --columns NAME,..., --plot" if result.done else ""
    _echo(f"{timing}study {study.digest[:12]}{further}")
    echo(f"store: {result.path}")
    if full:
        for item in study.inputs:
            _echo(f"{item.name}{f' [{item.unit}]' if item.unit else ''}: {item.text}")


def _echo(text: str) -> None:
    """Print a paragraph in lines that fit the terminal."""
    for line in folded(text):
        echo(line)
