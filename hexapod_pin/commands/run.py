"""`hexapod-pin run`: run a case that was written before, to the same bits."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hexapod_pin.commands.options import (
    Force,
    NoHtml,
    OptionalPath,
    Quick,
    Threads,
    TraceOut,
    Verdict,
)
from hexapod_pin.commands.terminal import echo


def run(
    case: Annotated[Path, typer.Argument(help="A file that `walk --save-case` left (case.toml).")],
    out: TraceOut = Path("run.nc"),
    html: Annotated[Path, typer.Option(help="Playback file to write.")] = Path("run.html"),
    no_html: NoHtml = False,
    verdict: Verdict = False,
    quick: Quick = False,
    force: Force = False,
    threads: Threads = 1,
    code: Annotated[
        OptionalPath,
        typer.Option("--import", help="A Python file that registers the case's own controller."),
    ] = None,
) -> None:
    """Run a case from its file; print its torque table; leave a trace and a playback."""
    from hexapod_pin.commands.case_report import run_and_report
    from hexapod_pin.commands.import_file import import_file
    from hexapod_pin.commands.output_files import PAGES, writable, writable_trace
    from hexapod_pin.simulation.case import load_case
    from hexapod_pin.simulation.work_limits import chosen_limits

    trace_path = writable_trace("--out", out)
    html_path = None if no_html else writable("--html", html, PAGES)
    if code is not None:
        import_file("--import", code)
    found = load_case(case).with_defaults(limits=chosen_limits(None, force))
    settings = found.settings
    robot = found.scene.robot
    echo(
        f"{robot.name}: {robot.total_mass:.5g} kg. {robot.provenance}\n"
        f"case {case}: {settings.duration:g} s, digest {found.digest}"
    )
    title = f"running {settings.duration:g} s"
    run_and_report(
        found, title, trace_path, html_path, verdict=verdict, quick=quick, threads=threads
    )
