"""`hexapod-pin sweep`: the cases of a study, kept as they finish, as one labelled dataset."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from hexapod_pin.commands.options import OptionalPath, OptionalText

OptionalInt = Optional[int]  # noqa: UP045


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
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with a store: finished cases are not run again.")
    ] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Go on with a store, and run failed cases again.")
    ] = False,
    threads: Annotated[
        OptionalInt,
        typer.Option(help="Cases at a time; default 2, with workers 1 in each of them."),
    ] = None,
    processes: Annotated[
        OptionalInt, typer.Option(help="Run on this many worker processes of this machine.")
    ] = None,
    scheduler: Annotated[
        OptionalText,
        typer.Option(help="Run on the workers of the Dask scheduler at this address."),
    ] = None,
    chunk: Annotated[int, typer.Option(help="Cases that a worker is given at a time.")] = 4,
    code: Annotated[
        OptionalPath,
        typer.Option(
            "--import",
            help="A Python file that registers controllers of your own (workers do not read it).",
        ),
    ] = None,
) -> None:
    """Run all cases of a study; what is finished is kept whatever happens."""
    from hexapod_pin.commands.import_file import import_file
    from hexapod_pin.commands.sweep_report import SweepFiles, run_and_report
    from hexapod_pin.sweep.study import load_sweep

    files = SweepFiles.checked(study, store=store, out=out, plot=plot)
    if code is not None:
        import_file("--import", code)
    run_and_report(
        load_sweep(study), files, threads=threads, processes=processes, scheduler=scheduler,
        chunk=chunk, resume=resume, retry_failed=retry_failed,
    )  # fmt: skip
