"""The commands `budget`, `stability` and `view` read a trace."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hexapod_pin.commands.options import (
    ImportCode,
    OptionalFloat,
    OptionalPath,
    OptionalText,
    Threads,
    TracePath,
    Verdict,
    import_code,
)
from hexapod_pin.commands.terminal import announce, echo

if TYPE_CHECKING:
    from hexapod_pin.results.peak_verdict import PeakVerdicts
    from hexapod_pin.results.sizing import MotorBudget, MotorRanking
    from hexapod_pin.results.trace import Trace


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
        OptionalText, typer.Option(help="Compare one motor with it: all joints, battery, heat.")
    ] = None,
    voltage: Annotated[
        OptionalFloat, typer.Option(help="Of the battery [V]: only rows of that voltage.")
    ] = None,
    code: ImportCode = None,
) -> None:
    """Print the torque budget of a trace."""
    announce(f"reading {trace}")
    from hexapod_pin.commands.case_report import verdict_on_peaks
    from hexapod_pin.results.trace_file import load_trace

    import_code(code)
    run = load_trace(trace)
    compared = catalog or catalog_file is not None or motor is not None or voltage is not None
    motors = motors_of(run, catalog_file, motor, voltage) if compared else None
    judged = verdict_on_peaks(run, threads) if verdict else None
    print_budget(run, judged, motors, json)


# What `hexapod-pin budget` prints.


def motors_of(
    trace: Trace, file: Path | None, motor: str | None, voltage: float | None
) -> MotorRanking | MotorBudget:
    """Return one motor compared with a run, or all of a catalogue.

    Raises:
        CatalogError: the file is not usable.
        UnknownNameError, ParameterError: no such motor or voltage.
    """
    from hexapod_pin.drive.catalog import load_catalog
    from hexapod_pin.results.sizing import motor_budget, motor_ranking

    rows = load_catalog(file)
    if motor is not None:
        return motor_budget(trace, rows.get(motor, voltage))
    chosen = rows if voltage is None else rows.at(voltage)
    return motor_ranking(trace, chosen, source=rows.source)


def print_budget(
    trace: Trace,
    judged: PeakVerdicts | None,
    motors: MotorRanking | MotorBudget | None,
    json: bool,
) -> None:
    """Print the budget, the verdict on its peaks, and motors, as text or JSON."""
    from hexapod_pin.results.torque_budget import torque_budget

    found = torque_budget(trace)
    more: dict[str, Any] = {}
    if judged is not None:
        more["verdict"] = judged.to_dict()
    if motors is not None:
        more["motors"] = motors.to_dict()
    if json:
        echo(found.to_json(**more))
        return
    texts = [part.table() for part in (found, judged, motors) if part is not None]
    echo("\n\n".join(texts))


# `hexapod-pin stability`: print the stability margins of a trace.


def stability(
    trace: TracePath,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    whole: Annotated[
        bool, typer.Option("--whole", help="All samples, start-up and stop included.")
    ] = False,
) -> None:
    """Print the stability margins of a trace: static, energy, zero-moment point."""
    announce(f"reading {trace}")
    from hexapod_pin.results.stability import stability as margins
    from hexapod_pin.results.trace_file import load_trace

    found = margins(load_trace(trace), whole=whole)
    echo(found.to_json() if json else found.table())


# `hexapod-pin view`: show a trace live in the browser.


def view(
    trace: TracePath,
    speed: Annotated[float, typer.Option(help="Simulated time over wall-clock time.")] = 1.0,
    port: Annotated[int, typer.Option(help="Port on this machine; 0 takes a free one.")] = 0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address only.")
    ] = False,
    package_path: Annotated[
        list[Path] | None, typer.Option(help="Folder of ROS packages with the robot's meshes.")
    ] = None,
) -> None:
    """Show a trace in the browser (meshcat) until Ctrl-C."""
    announce(f"reading {trace}")
    from hexapod_pin.results.trace_file import load_trace
    from hexapod_pin.view.html import view as show

    show(
        load_trace(trace), speed=speed, port=port, open_browser=not no_browser,
        package_path=package_path or (),
    )  # fmt: skip
