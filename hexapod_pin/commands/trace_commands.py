"""The commands `budget`, `stability` and `view` read a trace."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hexapod_pin.commands.options import (
    Assumed,
    EveryJoint,
    Full,
    ImportCode,
    OptionalFloat,
    OptionalPath,
    OptionalText,
    Shown,
    Threads,
    TracePath,
    Verdict,
    import_code,
)
from hexapod_pin.commands.terminal import announce, echo
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.results.peak_verdict import PeakVerdicts
    from hexapod_pin.results.sizing import MotorRanking
    from hexapod_pin.results.torque_budget import TorqueBudget
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.results.walk_answer import WalkAnswer


def budget(
    trace: TracePath,
    full: Full = False,
    joints: EveryJoint = False,
    assumed: Assumed = False,
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
    pack_resistance: Annotated[
        OptionalFloat,
        typer.Option(help="With --motor: internal resistance of the battery [ohm]; it sags."),
    ] = None,
    code: ImportCode = None,
) -> None:
    """Print the torque budget of a trace."""
    announce(f"reading {trace}")
    from hexapod_pin.commands.case_report import exit_by, verdict_on_peaks
    from hexapod_pin.drive.catalog import load_catalog
    from hexapod_pin.results.sizing import motor_ranking
    from hexapod_pin.results.torque_budget import torque_budget
    from hexapod_pin.results.trace_file import load_trace
    from hexapod_pin.results.walk_answer import walk_answer

    import_code(code)
    run, rows = load_trace(trace), load_catalog(catalog_file)
    record = None if motor is None else rows.usual(motor, voltage)
    shown = Shown(full, joints, assumed, json, verdict, threads=threads)
    if pack_resistance is not None and record is None:
        raise ParameterError("--pack-resistance", pack_resistance, "given with --motor")
    answer = walk_answer(run, record, voltage=voltage, pack_resistance=pack_resistance or 0.0)
    judged = verdict_on_peaks(run, threads) if verdict else None
    ranking = None
    if record is None and (catalog or catalog_file is not None or voltage is not None):
        chosen = rows if voltage is None else rows.at(voltage)
        ranking = motor_ranking(run, chosen, source=rows.source)
    found = answer.budget or torque_budget(run)  # which says why there is none
    if json:
        _print_budget_json(found, answer, judged, ranking)
    else:
        _print_budget(run, found, answer, judged, ranking, shown)
    exit_by(answer)


# What `hexapod-pin budget` prints.


def _print_budget_json(
    budget: TorqueBudget, answer: WalkAnswer, judged: PeakVerdicts | None,
    ranking: MotorRanking | None,
) -> None:  # fmt: skip
    """Print the budget, the verdict on its peaks, and motors, as JSON."""
    motors = answer.motor or ranking
    parts = {"verdict": judged, "motors": motors}
    more = {name: part.to_dict() for name, part in parts.items() if part is not None}
    echo(budget.to_json(**more))


def _print_budget(
    trace: Trace, found: TorqueBudget, answer: WalkAnswer, judged: PeakVerdicts | None,
    ranking: MotorRanking | None, shown: Shown,
) -> None:  # fmt: skip
    """Print the answer, and what was asked for besides."""
    from hexapod_pin.commands.case_report import print_doubts, print_parts

    echo("\n".join(answer.lines()))
    if ranking is not None and not shown.full:
        echo("\n" + "\n".join(ranking.short_lines()))
    print_doubts(trace, [], shown)
    if not shown.full:
        echo("--full has everything, --joints a line for every joint")
        print_parts(trace, found, shown)
    parts = (found, judged, answer.motor, ranking) if shown.full else (judged,)
    for part in parts:
        if part is not None:
            echo("\n" + part.table())


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
    motor: Annotated[
        OptionalText, typer.Option(help="Hold torques against this motor of the catalogue.")
    ] = None,
    voltage: Annotated[
        OptionalFloat, typer.Option(help="Of the battery, with --motor [V].")
    ] = None,
) -> None:
    """Show a trace in the browser until Ctrl-C: the page that `walk` writes."""
    announce(f"reading {trace}")
    from hexapod_pin.drive.catalog import load_catalog
    from hexapod_pin.results.trace_file import load_trace
    from hexapod_pin.view.html import view as show

    show(
        load_trace(trace), speed=speed, port=port, open_browser=not no_browser,
        package_path=package_path or (),
        motor=None if motor is None else load_catalog().usual(motor, voltage),
    )  # fmt: skip
