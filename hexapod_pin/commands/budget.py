"""`hexapod-pin budget`: print the torque budget of a trace, and the motors that carry it."""

from __future__ import annotations

from typing import Annotated

import typer

from hexapod_pin.commands.options import (
    OptionalFloat,
    OptionalPath,
    OptionalText,
    Threads,
    TracePath,
    Verdict,
)


def budget(
    trace: TracePath,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    verdict: Verdict = False,
    threads: Threads = 1,
    catalog: Annotated[
        bool, typer.Option("--catalog", help="Rank the motors of the catalogue for this run.")
    ] = False,
    catalog_file: Annotated[
        OptionalPath, typer.Option(help="Rank those of your own catalogue (CSV).")
    ] = None,
    motor: Annotated[
        OptionalText, typer.Option(help="Hold one motor against it: all joints, battery, heat.")
    ] = None,
    voltage: Annotated[
        OptionalFloat, typer.Option(help="Of the battery [V]: only rows of that voltage.")
    ] = None,
    code: Annotated[
        OptionalPath,
        typer.Option(
            "--import", help="A Python file that registers the trace's own controller (--verdict)."
        ),
    ] = None,
) -> None:
    """Print the torque budget of a trace."""
    from hexapod_pin.commands.budget_report import motors_of, print_budget
    from hexapod_pin.commands.case_report import verdict_on_peaks
    from hexapod_pin.commands.import_file import import_file
    from hexapod_pin.results.trace_file import load_trace

    if code is not None:
        import_file("--import", code)
    kept = load_trace(trace)
    wanted = catalog or catalog_file is not None or motor is not None or voltage is not None
    motors = motors_of(kept, catalog_file, motor, voltage) if wanted else None
    judged = verdict_on_peaks(kept, threads) if verdict else None
    print_budget(kept, judged, motors, json)
