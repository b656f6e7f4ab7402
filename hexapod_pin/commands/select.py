"""The command `select` finds motors that can drive a robot, and writes the report."""

from __future__ import annotations

import json as json_text
import os
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hexapod_pin.commands.options import Full, OptionalFloat, OptionalPath, RobotName
from hexapod_pin.commands.output_files import report_marks, written_files
from hexapod_pin.commands.progress import progress_bar
from hexapod_pin.commands.study_options import (
    Processes,
    Resume,
    RetryFailed,
    Scheduler,
    Store,
    StudyThreads,
    run_options,
)
from hexapod_pin.commands.terminal import announce, echo
from hexapod_pin.errors import ParameterError, StudyInterrupted
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.results.motor_selection import MotorSelection


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
    bus: Annotated[
        list[str] | None, typer.Option(help="Only motors with this bus: TTL, RS-485, PWM, CAN.")
    ] = None,
    maker: Annotated[
        list[str] | None, typer.Option(help="Only motors of this maker; may be repeated.")
    ] = None,
    price_below: Annotated[
        OptionalFloat,
        typer.Option(
            help="Only motors with a known price up to this, in the catalogue's currency."
        ),
    ] = None,
    motor_mass: Annotated[
        OptionalFloat,
        typer.Option(
            help="Of each motor that the robot's file contains [kg]; 0: none. Default: 35 % of the "
            "robot's mass in all, assumed."
        ),
    ] = None,
    repair: Annotated[
        bool, typer.Option("--repair", help="Repair the robot's file first.")
    ] = False,
    html: Annotated[
        OptionalPath,
        typer.Option(
            help="Report to write: .html, which prints as A4. Default: motors.html, where "
            "matplotlib is installed."
        ),
    ] = None,
    no_html: Annotated[bool, typer.Option("--no-html", help="Write no report.")] = False,
    csv: Annotated[OptionalPath, typer.Option(help="Table to write, one row per joint type.")] = (
        None
    ),
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
    full: Full = False,
    quick: Annotated[bool, typer.Option("--quick", help="Leave out the uncertain inputs.")] = False,
    store: Store = None,
    resume: Resume = False,
    retry_failed: RetryFailed = False,
    threads: StudyThreads = None,
    processes: Processes = None,
    scheduler: Scheduler = None,
) -> None:
    """Rank motors for a robot: each simulated with its mass, inertia and torque-speed line."""
    announce(f"reading {robot}")
    from hexapod_pin.commands.output_files import writable
    from hexapod_pin.commands.terminal import NONE_PASSES, fail, interrupted_status
    from hexapod_pin.study.selection import select_motors

    drawn = html is not None or find_spec("matplotlib") is not None
    report = None if no_html or not drawn else report_path(html)
    table = None if csv is None else writable("--csv", csv, (".csv",))
    given = {
        "catalog": None if catalog is None else str(user_path(catalog).absolute()),
        "voltage": voltage, "buses": bus or None, "makers": maker or None,
        "dearest": price_below, "motor_mass": motor_mass,
    }  # fmt: skip
    text, folder = study_text(robot, study, given, repair)
    how = run_options(store, resume, retry_failed, threads, processes, scheduler)
    try:
        with progress_bar("motors", left=True) as bar:
            found = select_motors(
                text, folder, samples=0 if quick else None, stage=bar.stage, **how
            )
    except StudyInterrupted as error:
        if error.result is None:
            raise
        found = error.result
    print_selection(found, json, full)
    write_files(found, report, table)
    if not drawn and not no_html:
        echo(NO_REPORT, err=True)
    if found.interrupted:
        fail("interrupted; what was done is listed above", interrupted_status())
    if not found.best.passes:
        fail("no motor of the catalogue carries every joint on every walk", NONE_PASSES)


# What `hexapod-pin select` reads and leaves: the text of its study, tables, files.


NO_REPORT = "no report: matplotlib is not installed; pip install matplotlib brings motors.html"


def report_path(html: Path | None) -> Path:
    """Return where the report goes; raises as `writable`."""
    from hexapod_pin.commands.output_files import PAGES, writable

    return writable("--html", html or Path("motors.html"), PAGES, drawn=True)


OPTIONS = {"buses": "--bus", "makers": "--maker", "dearest": "--price-below"}
"""Options whose value in a study has another name."""


def study_text(
    robot: str,
    study: Path | None,
    given: Mapping[str, Any],
    repair: bool,
) -> tuple[str, Path]:
    """Return the text of the study with the options in it, and where its relative paths start.

    `given`: values for its table `motors`, None where an option is not given.

    Raises:
        ParameterError: the file is not readable, has another robot, or gives what an option gives.
    """
    import tomli_w

    from hexapod_pin.spec import read_toml
    from hexapod_pin.study.selection import load_motor_study

    if study is None:
        text, folder = _default(robot, repair), Path.cwd()
    else:
        text, folder = load_motor_study(study)
    data = read_toml(text)
    base = data.setdefault("base", {"accuracy": 1e-4})
    if study is not None:
        _require_same_robot(base, robot, study)
    base |= {"robot": _source(robot), **({"repair": True} if repair else {})}
    base.pop("case", None)
    motors = data.setdefault("motors", {})
    for name, value in given.items():
        if value is None:
            continue
        if name in motors:
            option = OPTIONS.get(name, f"--{name.replace('_', '-')}")
            allowed = f"left out: motors.{name} of {study} gives it"
            raise ParameterError(option, value, allowed)
        motors[name] = value
    return tomli_w.dumps(data), folder


def _default(robot: str, repair: bool) -> str:
    from hexapod_pin.control.feasible_gait import default_gait
    from hexapod_pin.control.gait import gaits_for
    from hexapod_pin.robot.robot import load_robot
    from hexapod_pin.study.selection import default_study

    loaded = load_robot(_source(robot), repair=repair)
    names = [default_gait(loaded)]
    if "tripod" in gaits_for(len(loaded.legs)):
        names.insert(0, "tripod")
    return default_study(_source(robot), names, loaded.total_mass)


def _source(robot: str) -> str:
    """Return a robot's name, or the absolute path of its file."""
    place = user_path(robot)
    return str(place.absolute()) if os.path.isfile(place) else robot


def _require_same_robot(base: Any, robot: str, study: Path) -> None:
    if not isinstance(base, dict):
        raise ParameterError("base", base, "a table: [base]")
    if "case" in base:
        raise ParameterError(
            "base.case", base["case"], f"left out of {study}: the robot is given beside it",
            "Write the walk in short: gait, contact, duration, accuracy.",
        )  # fmt: skip
    other = base.get("robot")
    if isinstance(other, str) and Path(other).name != Path(robot).name:
        raise ParameterError("ROBOT", robot, f"{other!r}, the robot of {study}")


def print_selection(selection: MotorSelection, json: bool, full: bool) -> None:
    """Print the answer, everything, or JSON."""
    if json:
        echo(json_text.dumps(selection.to_dict(), indent=2, allow_nan=False))
    else:
        echo(selection.table() if full else "\n".join(selection.lines()))


def write_files(selection: MotorSelection, report: Path | None, table: Path | None) -> None:
    """Write the report and the table."""
    with written_files() as written:
        if report is not None:
            from hexapod_pin.view.selection_report import write_selection_report

            written(lambda: write_selection_report(selection, report, **report_marks()), err=True)
        if table is not None:
            from hexapod_pin.results.motor_selection import write_selection_csv

            written(lambda: write_selection_csv(selection, table), err=True)
