"""Run a comparison with a progress bar, print it, and leave its files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

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
            ParameterError: the figure's ending is not that of a figure, or two files are one.
            TraceFileError: a folder is missing or read-only, or `--json` has another ending.
        """
        from hexapod_pin.commands.output_files import writable
        from hexapod_pin.results.file_ending import JSON, check_ending
        from hexapod_pin.view.contact_figure import require_ending

        given = {"--html": html, "--figure": figure, "--json": json}
        paths = {option: writable(option, path) for option, path in given.items() if path}
        if len({os.path.realpath(path) for path in paths.values()}) < len(paths):
            raise ParameterError(" ".join(paths), "one file", "different files")
        if json is not None:
            check_ending(f"--json {json}", JSON)
        if figure is not None:
            require_ending(figure)
            if find_spec("matplotlib") is None:
                raise ParameterError("--figure", str(figure), "given with matplotlib installed",
                                     "pip install 'hexapod-pin[plot]' brings it.")  # fmt: skip
        return cls(paths.get("--html"), paths.get("--figure"), paths.get("--json"))


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
        _tell(error.comparison, files, markdown)
        raise
    _tell(found, files, markdown)
    if files.figure is not None:
        from hexapod_pin.view.comparison_figure import write_comparison_figure

        echo(f"wrote {write_comparison_figure(found, files.figure)}")
    if files.html is not None:
        _play(planned, files.html, threads)
    return found


def _tell(found: Comparison, files: ComparisonFiles, markdown: bool) -> None:
    """Print the tables and write the numbers."""
    echo(found.to_markdown() if markdown else found.table())
    echo("")
    if files.json is not None:
        echo(f"wrote {found.save(files.json)}")


def _play(planned: Sequence[PlannedRun], path: Path, threads: int) -> None:
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
        echo(f"wrote {write_side_by_side(traces, path)}")
