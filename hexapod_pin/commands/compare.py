"""The command `compare` compares controllers on the same scene: printed, drawn, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional

import typer

from hexapod_pin.commands.options import (
    Full,
    ImportCode,
    OptionalFloat,
    OptionalPath,
    import_code,
)
from hexapod_pin.commands.output_files import (
    PAGES,
    WrittenFiles,
    report_marks,
    writable,
    writable_figure,
    written_files,
)
from hexapod_pin.commands.progress import progress_bar
from hexapod_pin.commands.study_options import (
    Processes,
    Resume,
    RetryFailed,
    Scheduler,
    Store,
    StudyThreads,
    run_options,
    with_progress,
)
from hexapod_pin.commands.terminal import announce, echo, typed_command
from hexapod_pin.errors import DivergenceError, ParameterError, StudyInterrupted

if TYPE_CHECKING:
    from hexapod_pin.results.comparison import Comparison
    from hexapod_pin.study.compare import PlannedRun


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
        typer.Option(help="Distance that the bumps reach [m]; default: as far as the gaits walk."),
    ] = None,
    flat_radius: Annotated[
        OptionalFloat,
        typer.Option(
            help="Distance from the start up to which the ground is level [m]; default 0."
        ),
    ] = None,
    html: Annotated[
        OptionalPath,
        typer.Option(help="Playback to write: the first ground, the others as bands of plots."),
    ] = None,
    figure: Annotated[
        OptionalPath, typer.Option(help="Bar chart to write: .png, .svg or .pdf.")
    ] = None,
    report: Annotated[
        OptionalPath,
        typer.Option(help="Report to write: .html with figure and sortable tables."),
    ] = None,
    json: Annotated[
        OptionalPath, typer.Option("--json", help="All numbers to write, as JSON.")
    ] = None,
    full: Full = False,
    markdown: Annotated[
        bool, typer.Option("--markdown", help="Print the tables as Markdown.")
    ] = False,
    store: Store = None,
    resume: Resume = False,
    retry_failed: RetryFailed = False,
    threads: StudyThreads = None,
    processes: Processes = None,
    scheduler: Scheduler = None,
    code: ImportCode = None,
) -> None:
    """Compare the controllers of cases on the scene of the first, in its settings."""
    announce(f"reading {', '.join(map(str, cases))}")
    from hexapod_pin.commands.compare_cases import (
        bumpy,
        controlled,
        own_runs,
        read_cases,
        shared_runs,
        study_scenes,
    )
    from hexapod_pin.results.result_files import JSON
    from hexapod_pin.study.compare import compared
    from hexapod_pin.study.runs.runner import run_study

    html = None if html is None else writable("--html", html, PAGES)
    figure = None if figure is None else writable_figure("--figure", figure)
    report = None if report is None else writable("--report", report, PAGES, drawn=True)
    json = None if json is None else writable("--json", json, JSON)
    how = run_options(store, resume, retry_failed, threads, processes, scheduler)
    import_code(code)
    found = read_cases(cases)
    if controllers is not None:
        found = controlled(found, controllers, own_scenes=own_scenes)
    scenes = study_scenes(found, grounds, own_scenes=own_scenes or bumps is not None) or bumpy(
        found, amplitude=bumps, wavelength=wavelength, seeds=seeds, length=length,
        flat_radius=flat_radius, own_scenes=own_scenes,
    )  # fmt: skip
    planned = own_runs(found) if own_scenes else shared_runs(found, scenes)
    if figure is not None and len({plan.controller for plan in planned}) < 2:
        raise ParameterError("--figure", str(figure), "given with two cases or more")
    try:
        with progress_bar(f"{len(planned)} runs", left=True) as progress:
            comparison = run_study(compared, planned, **with_progress(how, progress))
    except StudyInterrupted as error:
        if error.result is not None:
            with written_files() as written:
                _report(error.result, json, markdown, full, written)
        raise
    with written_files() as written:
        _report(comparison, json, markdown, full, written)
        if figure is not None:
            from hexapod_pin.view.study_figures import write_comparison_figure

            written(lambda: write_comparison_figure(comparison, figure))
        if report is not None:
            from hexapod_pin.view.study_report import write_study_report

            written(lambda: write_study_report(comparison, report, **report_marks()))
        if html is not None:
            _play(planned, html, threads or 1, written)


def _report(
    found: Comparison, json: Path | None, markdown: bool, full: bool, written: WrittenFiles
) -> None:
    """Print the answer or the tables, and write the numbers."""
    if markdown:
        echo(found.to_markdown())
    else:
        echo(found.table() if full else "\n".join(found.lines()))
    if markdown or full:
        echo("")
    if json is not None:
        written(lambda: found.save(json))


MOST_SHOWN = 16
"""Variants of the first scene in a playback, at most: each adds its samples to the page."""


def _play(planned: Sequence[PlannedRun], path: Path, threads: int, written: WrittenFiles) -> None:
    """Run the variants of the first scene again, with samples, and write their playback.

    The first is played; the others of each controller make the bands of its plots.
    """
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.simulation.batch import simulate_batch
    from hexapod_pin.view.side_by_side import write_side_by_side

    shown = [run for run in planned if run.scene == planned[0].scene and run.number < MOST_SHOWN]
    with progress_bar("playback") as progress:
        results = simulate_batch([run.case for run in shown], threads=threads, progress=progress)
    traces: dict[str, Trace] = {}
    spread: dict[str, list[Trace]] = {}
    for run, result in zip(shown, results, strict=True):
        trace = result.trace if isinstance(result, DivergenceError) else result
        name = run.controller
        if not isinstance(trace, Trace):
            echo(f"no playback of {name}: {result}", err=True)
        elif run.number == 0:
            traces[name] = trace
        elif name in traces and len(trace.time) == len(traces[name].time):
            spread.setdefault(name, []).append(trace)
        else:
            echo(f"variant {run.number} of {name} is in no band: it ended early", err=True)
    count = sum(run.scene == planned[0].scene for run in planned)
    if count > len(shown):
        echo(f"playback: {len(shown)} of {count} runs of {planned[0].scene}", err=True)
    if traces:
        written(lambda: write_side_by_side(traces, path, spread=spread, command=typed_command()))
