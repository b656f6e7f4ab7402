"""`hexapod-pin verify`: compare the formulations with each other and with closed forms."""

from __future__ import annotations

from typing import Annotated

import typer

from hexapod_pin.commands.options import OptionalPath, OptionalText


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
    """Compare the formulations with each other and with closed forms; fail where two disagree."""
    from hexapod_pin.validation.checks.command import verify as run

    run(everything=everything, only=only, out=out)
