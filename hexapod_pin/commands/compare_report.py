"""Run a comparison with a progress bar, print it, and leave its files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.commands.output_files import (
    PAGES,
    WrittenFiles,
    writable,
    writable_figure,
    written_files,
)
from hexapod_pin.commands.terminal import echo
from hexapod_pin.errors import DivergenceError, ParameterError, SimulationInterrupted

if TYPE_CHECKING:
    from hexapod_pin.results.comparison import Comparison
    from hexapod_pin.sweep.compare import PlannedRun


@dataclass(frozen=True)
class ComparisonFiles:
    """What to write besides the printed table; None: nothing.

    Attributes:
        html: playback of the first variant of the first scene, side by side.
        figure: bars relative to the baseline.
        json: all numbers.
    """

    html: Path | None = None
    figure: Path | None = None
    json: Path | None = None

    @classmethod
    def checked(
        cls, *, html: Path | None, figure: Path | None, json: Path | None
    ) -> ComparisonFiles:
        """Refuse now, rather than after the runs, what cannot be written.

        Raises:
            TraceFileError, FileConflictError, MissingPackageError: as of `writable`.
        """
        from hexapod_pin.results.file_ending import JSON

        return cls(
            None if html is None else writable("--html", html, PAGES),
            None if figure is None else writable_figure("--figure", figure),
            None if json is None else writable("--json", json, JSON),
        )


def compare_and_report(
    planned: Sequence[PlannedRun],
    files: ComparisonFiles,
    *,
    threads: int = 1,
    markdown: bool = False,
) -> Comparison:
    """Run and compare; print tables; write files. After Ctrl-C, what was done is printed and kept.

    Args:
        planned: from `hexapod_pin.sweep.compare.plan_runs`, or runs of one's own.
        files: what to write.
        threads: as of `simulate_batch`.
        markdown: print Markdown.

    Raises:
        ParameterError: threads out of range, or a figure of nothing to compare.
        SimulationInterrupted: Ctrl-C.
    """
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.sweep.compare import compare_runs

    if files.figure is not None and len({plan.controller for plan in planned}) < 2:
        raise ParameterError("--figure", str(files.figure), "given with two cases or more")
    try:
        with progress_bar(f"{len(planned)} runs") as progress:
            found = compare_runs(planned, threads=threads, progress=progress)
    except SimulationInterrupted as error:
        with written_files() as written:
            _report(error.comparison, files.json, markdown, written)
        raise
    figure, html = files.figure, files.html
    with written_files() as written:
        _report(found, files.json, markdown, written)
        if figure is not None:
            from hexapod_pin.view.comparison_figure import write_comparison_figure

            written(lambda: write_comparison_figure(found, figure))
        if html is not None:
            _play(planned, html, threads, written)
    return found


def _report(found: Comparison, json: Path | None, markdown: bool, written: WrittenFiles) -> None:
    """Print the tables and write the numbers."""
    echo(found.to_markdown() if markdown else found.table())
    echo("")
    if json is not None:
        written(lambda: found.save(json))


def _play(planned: Sequence[PlannedRun], path: Path, threads: int, written: WrittenFiles) -> None:
    """Run the first variant of the first scene again, with samples, and write its playback."""
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.simulation.batch import simulate_batch
    from hexapod_pin.view.side_by_side import write_side_by_side

    first = planned[0]
    shown = [run for run in planned if (run.scene, run.number) == (first.scene, first.number)]
    cases = [run.case for run in shown]
    with progress_bar("playback") as progress:
        results = simulate_batch(cases, threads=threads, progress=progress)
    traces = {}
    for run, result in zip(shown, results, strict=True):
        trace = result.trace if isinstance(result, DivergenceError) else result
        if isinstance(trace, Trace):
            traces[run.controller] = trace
        else:
            echo(f"no playback of {run.controller}: {result}", err=True)
    if traces:
        written(lambda: write_side_by_side(traces, path))
