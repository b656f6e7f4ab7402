"""`hexapod-pin select`: which motors carry a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hexapod_pin.commands.options import OptionalFloat, OptionalPath, RobotName


def select(
    robot: RobotName,
    study: Annotated[
        OptionalPath,
        typer.Argument(
            help="A study file: walks ([[vary]] with values), uncertain inputs (with a "
            "distribution), [motors], [derating]. Without one: tripod and the default gait, "
            "without and with a payload of 10 % of the robot's mass."
        ),
    ] = None,
    catalog: Annotated[
        OptionalPath, typer.Option(help="Your own catalogue of motors (CSV); default: ours.")
    ] = None,
    voltage: Annotated[
        OptionalFloat, typer.Option(help="Of the battery [V]: only rows of that voltage.")
    ] = None,
    motor_mass: Annotated[
        OptionalFloat,
        typer.Option(
            help="Of each motor that the robot's file contains [kg]; 0: none. Default: 35 % of the "
            "robot's mass in all, assumed."
        ),
    ] = None,
    mend: Annotated[bool, typer.Option("--mend", help="Mend the robot's file first.")] = False,
    html: Annotated[Path, typer.Option(help="Report to write: .html or .pdf.")] = Path(
        "motors.html"
    ),
    no_html: Annotated[bool, typer.Option("--no-html", help="Write no report.")] = False,
    csv: Annotated[OptionalPath, typer.Option(help="Table to write, one row per joint type.")] = (
        None
    ),
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Leave out the uncertain inputs.")] = False,
    threads: Annotated[int, typer.Option(help="Runs at a time.")] = 2,
) -> None:
    """Rank motors for a robot: each simulated with its mass, inertia and torque-speed line."""
    from hexapod_pin.commands.output_files import writable
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.commands.select_report import print_selection, study_text, write_files
    from hexapod_pin.commands.status import NONE_PASSES, fail, interrupted_status
    from hexapod_pin.sweep.selection import select_motors

    report = None if no_html else writable("--html", html, (".html", ".pdf"), drawn=True)
    table = None if csv is None else writable("--csv", csv, (".csv",))
    text, folder = study_text(robot, study, catalog, voltage, motor_mass, mend)
    with progress_bar("motors") as bar:
        found = select_motors(
            text, folder, threads=threads, samples=0 if quick else None, stage=bar.stage
        )
    print_selection(found, json)
    write_files(found, report, table)
    if found.interrupted:
        fail("interrupted; what was done is listed above", interrupted_status())
    if not found.best.passes:
        fail("no motor of the catalogue carries every joint on every walk", NONE_PASSES)
