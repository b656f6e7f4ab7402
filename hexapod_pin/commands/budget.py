"""`hexapod-pin budget`: print the torque budget of a trace."""

from __future__ import annotations

from typing import Annotated

import typer

from hexapod_pin.commands.options import TracePath


def budget(
    trace: TracePath,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Print the torque budget of a trace."""
    from hexapod_pin.results.torque_budget import torque_budget
    from hexapod_pin.results.trace_file import load_trace

    found = torque_budget(load_trace(trace))
    typer.echo(found.to_json() if json else found.table())
