"""`hexapod-pin compare`: controllers on the same scene, printed, drawn and played side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from hexapod_pin.commands.options import OptionalFloat, OptionalPath


def compare(
    cases: Annotated[
        list[Path],
        typer.Argument(help="Files that `walk --save-case` left; the first is the baseline."),
    ],
    controllers: Annotated[
        Optional[str],  # noqa: UP045
        typer.Option(
            help="Walk the first case's walk under these instead, separated by commas: "
            "conventional, slip, suspension, both, all.",
        ),
    ] = None,
    grounds: Annotated[
        Optional[str],  # noqa: UP045
        typer.Option(
            help="Put it on these, separated by commas: flat, slope, bumps, step, slippery, soft, "
            "soil; sized by the gait's lift.",
        ),
    ] = None,
    own_scenes: Annotated[
        bool,
        typer.Option(
            "--own-scenes",
            help="Run each case as it is, and not its controller on the first case's scene.",
        ),
    ] = False,
    bumps: Annotated[
        OptionalFloat,
        typer.Option(help="Put the scene on random bumps of this largest height [m]."),
    ] = None,
    wavelength: Annotated[
        OptionalFloat, typer.Option(help="Typical distance between bumps [m]; default 0.4.")
    ] = None,
    seeds: Annotated[
        Optional[int],  # noqa: UP045
        typer.Option(help="How many random grounds to draw, with seeds 0, 1, ...; default 8."),
    ] = None,
    length: Annotated[
        OptionalFloat,
        typer.Option(help="Way that the bumps reach [m]; default: as far as the gaits go."),
    ] = None,
    level: Annotated[
        OptionalFloat,
        typer.Option(
            help="Distance from the start up to which the ground is level [m]; default 0."
        ),
    ] = None,
    html: Annotated[
        OptionalPath, typer.Option(help="Playback of the first ground, side by side, to write.")
    ] = None,
    figure: Annotated[
        OptionalPath, typer.Option(help="Bar chart to write: .png, .svg or .pdf.")
    ] = None,
    json: Annotated[
        OptionalPath, typer.Option("--json", help="All numbers to write, as JSON.")
    ] = None,
    markdown: Annotated[
        bool, typer.Option("--markdown", help="Print the tables as Markdown.")
    ] = False,
    threads: Annotated[int, typer.Option(help="Runs at a time.")] = 1,
    code: Annotated[
        OptionalPath,
        typer.Option("--import", help="A Python file that registers controllers of your own."),
    ] = None,
) -> None:
    """Compare the controllers of cases on the scene of the first, in its settings."""
    from hexapod_pin.commands.compare_cases import (
        bumpy,
        controlled,
        own_runs,
        read_cases,
        shared_runs,
        study_scenes,
    )
    from hexapod_pin.commands.compare_report import ComparisonFiles, compare_and_report
    from hexapod_pin.commands.import_file import import_file

    files = ComparisonFiles.checked(html=html, figure=figure, json=json)
    if code is not None:
        import_file("--import", code)
    found = read_cases(cases)
    if controllers is not None:
        found = controlled(found, controllers, own_scenes=own_scenes)
    scenes = study_scenes(found, grounds, own_scenes=own_scenes or bumps is not None) or bumpy(
        found, amplitude=bumps, wavelength=wavelength, seeds=seeds, length=length, level=level,
        own_scenes=own_scenes,
    )  # fmt: skip
    planned = own_runs(found) if own_scenes else shared_runs(found, scenes)
    compare_and_report(planned, files, threads=threads, markdown=markdown)
