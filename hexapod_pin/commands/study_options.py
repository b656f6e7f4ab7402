"""Options of every command that runs a study: the store of its rows, and what runs its cases."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional

import typer

from hexapod_pin.commands.options import OptionalPath, OptionalText

if TYPE_CHECKING:
    from hexapod_pin.study.runs.runner import RunOptions

OptionalInt = Optional[int]  # noqa: UP045

Store = Annotated[
    OptionalPath,
    typer.Option("--store", help="SQLite file that keeps every finished case; default: none."),
]
Resume = Annotated[
    bool, typer.Option("--resume", help="Go on with a store: finished cases are not run again.")
]
RetryFailed = Annotated[
    bool, typer.Option("--retry-failed", help="Go on with a store, and run failed cases again.")
]
StudyThreads = Annotated[
    OptionalInt,
    typer.Option("--threads", help="Cases at a time; default 2, with workers 1 in each of them."),
]
Processes = Annotated[
    OptionalInt, typer.Option(help="Run on this many worker processes of this machine.")
]
Scheduler = Annotated[
    OptionalText,
    typer.Option(help="Run on the workers of the Dask scheduler at this address."),
]


def run_options(
    store: Path | None,
    resume: bool,
    retry_failed: bool,
    threads: int | None,
    processes: int | None,
    scheduler: str | None,
) -> RunOptions:
    """Return the options of a study; its store is refused now where it cannot be written.

    Raises:
        TraceFileError, FileConflictError: as of `writable`.
    """
    from hexapod_pin.commands.output_files import writable

    return {
        "store": None if store is None else writable("--store", store),
        "resume": resume,
        "retry_failed": retry_failed,
        "threads": threads,
        "processes": processes,
        "scheduler": scheduler,
    }


def with_progress(options: RunOptions, progress: Callable[[float], None]) -> RunOptions:
    """Return the options with a function that receives the finished fraction."""
    return {**options, "progress": progress}
