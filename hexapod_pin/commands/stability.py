"""`hexapod-pin stability`: print the stability margins of a trace."""

from __future__ import annotations

from typing import Annotated

import typer

from hexapod_pin.commands.options import TracePath
from hexapod_pin.commands.terminal import echo


def stability(
    trace: TracePath,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    whole: Annotated[
        bool, typer.Option("--whole", help="All samples, start-up and stop included.")
    ] = False,
) -> None:
    """Print the stability margins of a trace: static, energy, zero-moment point."""
    from hexapod_pin.results.stability import stability as margins
    from hexapod_pin.results.trace_file import load_trace

    found = margins(load_trace(trace), whole=whole)
    echo(found.to_json() if json else found.table())
