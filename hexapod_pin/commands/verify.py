"""`hexapod-pin verify`: compare the formulations with each other and with closed forms."""

from __future__ import annotations

from typing import Annotated

import typer

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.commands.options import OptionalPath, OptionalText
from hexapod_pin.commands.output_files import writable
from hexapod_pin.commands.progress import progress_bar
from hexapod_pin.commands.status import MISSED, fail
from hexapod_pin.commands.terminal import echo
from hexapod_pin.errors import SimulationInterrupted


def verify(
    everything: Annotated[
        bool, typer.Option("--all", help="MuJoCo, where installed, and the hard cases too.")
    ] = False,
    only: Annotated[
        OptionalText,
        typer.Option(help="Names of checks, separated by commas; default: every check."),
    ] = None,
    out: Annotated[
        OptionalPath,
        typer.Option(help="Markdown file to write the table to."),
    ] = None,
) -> None:
    """Compare the formulations with each other and with closed forms.

    Exit status 0: every row that ran met its number or is an expected failure; 1: one did not.
    """
    from hexapod_pin.validation.checks.registry import run_checks
    from hexapod_pin.validation.tables import failures_text, result_table, summary

    path = None if out is None else writable("--out", out)
    names = None if only is None else [name.strip() for name in only.split(",")]
    stopped = None
    try:
        with progress_bar("verifying") as progress:
            results = run_checks(names=names, everything=everything, progress=progress)
    except SimulationInterrupted as error:
        results, stopped = list(error.results or ()), error
    table, told = result_table(results), summary(results)
    told += "" if stopped is None else f"\n{stopped}"
    echo(f"{table.text()}\n{told}")
    if path is not None:
        write_atomically(path, f"{table.markdown()}\n{told}\n")
        echo(f"wrote {path}")
    if stopped is not None:
        raise stopped
    if any(result.failed for result in results):
        fail(failures_text(results), MISSED)
