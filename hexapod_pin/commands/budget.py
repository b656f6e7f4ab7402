"""`hexapod-pin budget`: print the torque budget of a trace."""

from __future__ import annotations

from typing import Annotated

import typer

from hexapod_pin.commands.options import OptionalPath, Threads, TracePath, Verdict


def budget(
    trace: TracePath,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    verdict: Verdict = False,
    threads: Threads = 1,
    code: Annotated[
        OptionalPath,
        typer.Option(
            "--import", help="A Python file that registers the trace's own controller (--verdict)."
        ),
    ] = None,
) -> None:
    """Print the torque budget of a trace."""
    from hexapod_pin.commands.case_report import verdict_on_peaks
    from hexapod_pin.commands.import_file import import_file
    from hexapod_pin.results.torque_budget import torque_budget
    from hexapod_pin.results.trace_file import load_trace

    if code is not None:
        import_file("--import", code)
    kept = load_trace(trace)
    found = torque_budget(kept)
    judged = verdict_on_peaks(kept, threads) if verdict else None
    if json:
        typer.echo(found.to_json() if judged is None else found.to_json(verdict=judged.to_dict()))
        return
    typer.echo(found.table())
    if judged is not None:
        typer.echo("\n" + judged.table())
