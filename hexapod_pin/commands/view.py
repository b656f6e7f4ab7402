"""`hexapod-pin view`: show a trace live in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hexapod_pin.commands.options import TracePath


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
    from hexapod_pin.results.trace_file import load_trace
    from hexapod_pin.view.html import view as show

    show(
        load_trace(trace), speed=speed, port=port, open_browser=not no_browser,
        package_path=package_path or (),
    )  # fmt: skip
