"""The commands `bench` and `verify` measure speed against error and compare with known answers."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional

import typer

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.commands.loading_options import Feet, FootRadius, foot_names
from hexapod_pin.commands.options import OptionalFloat, OptionalPath, OptionalText
from hexapod_pin.commands.output_files import writable, writable_figure, written_files
from hexapod_pin.commands.progress import progress_bar
from hexapod_pin.commands.terminal import MISSED, announce, echo, fail
from hexapod_pin.errors import ParameterError, SimulationInterrupted

if TYPE_CHECKING:
    from hexapod_pin.benchmark.work_precision.comparison import Comparison, ComparisonSettings
    from hexapod_pin.benchmark.work_precision.scenes import SceneOptions
    from hexapod_pin.benchmark.work_precision.task import Task


def bench(
    scenes: Annotated[
        Optional[list[str]],  # noqa: UP045
        typer.Argument(
            help="walk, stand, hc40-soft, hc40-mid, hc40-stiff; a scene file (.toml); a robot: its "
            "name or the path of its URDF."
        ),
    ] = None,
    hard: Annotated[
        bool,
        typer.Option(
            "--hard", help="The hard cases, random extremes, calibration of the accuracy."
        ),
    ] = False,
    methods: Annotated[
        OptionalText,
        typer.Option(help="Names, separated by commas; default: all."),
    ] = None,
    advise: Annotated[
        OptionalFloat,
        typer.Option(help="Only advise how to reach this accuracy at least cost [m, rad]."),
    ] = None,
    engines: Annotated[
        bool,
        typer.Option(
            "--engines", "--peers", help="MuJoCo, Drake and PyBullet too, where installed."
        ),
    ] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer settings.")] = False,
    rounds: Annotated[int, typer.Option(help="Timed rounds; the median counts.")] = 5,
    out: Annotated[
        OptionalPath,
        typer.Option(help="Report to write: .md, .csv or .json."),
    ] = None,
    plot: Annotated[
        OptionalPath,
        typer.Option(help="Figure to write: .png, .svg or .pdf."),
    ] = None,
    duration: Annotated[
        OptionalFloat,
        typer.Option(help="Simulated time [s]; default: the scene's own, or one cycle."),
    ] = None,
    sample: Annotated[
        OptionalFloat,
        typer.Option(help="Time between compared samples [s]."),
    ] = None,
    gait: Annotated[
        OptionalText,
        typer.Option(help="tripod, ripple, tetrapod, wave or hold; default tetrapod."),
    ] = None,
    stroke: Annotated[
        OptionalFloat,
        typer.Option(help="[m]; default as in `walk`."),
    ] = None,
    cycle_time: Annotated[
        OptionalFloat,
        typer.Option(help="Cycle time [s]; default 2.4."),
    ] = None,
    contact: Annotated[
        OptionalText,
        typer.Option(help="accurate, s1, s1-printed, s2 or soil; default accurate."),
    ] = None,
    mu: Annotated[OptionalFloat, typer.Option(help="Friction coefficient.")] = None,
    kp: Annotated[
        OptionalFloat,
        typer.Option(help="Servo stiffness [N m/rad]."),
    ] = None,
    kd: Annotated[
        OptionalFloat,
        typer.Option(help="Servo damping [N m s/rad]."),
    ] = None,
    feet: Feet = None,
    foot_radius: FootRadius = None,
) -> None:
    """Measure speed against error on a scene, every method and other engines."""
    if hard:
        return _hard(quick, out)
    if not scenes:
        raise ParameterError("SCENE", None, "named, or --hard given", "See --help.")
    announce(f"reading {', '.join(scenes)}")
    from hexapod_pin.benchmark.work_precision.comparison import ComparisonSettings
    from hexapod_pin.benchmark.work_precision.scenes import SceneOptions

    options = SceneOptions(
        gait=gait, stroke=stroke, cycle_time=cycle_time, contact=contact, mu=mu, kp=kp, kd=kd,
        feet=None if feet is None else tuple(foot_names(feet) or ()),
        foot_radius=foot_radius, duration=duration, sample=sample,
    )  # fmt: skip
    names = None if methods is None else [name.strip() for name in methods.split(",")]
    settings = ComparisonSettings(names, rounds, quick, engines)
    _measure(scenes, options, settings, advise, _report_files(out, plot))


def _measure(
    scenes: list[str],
    options: SceneOptions,
    settings: ComparisonSettings,
    accuracy: float | None,
    files: tuple[Path | None, Path | None],
) -> None:
    """Measure, print, write and draw; what is done when Ctrl-C comes is printed and written too."""
    from hexapod_pin.benchmark.report import (
        BenchmarkReport,
        row_name,
        scene_text,
        write_plot,
        write_report,
    )
    from hexapod_pin.benchmark.work_precision.comparison import command_text
    from hexapod_pin.benchmark.work_precision.scenes import find_task
    from hexapod_pin.validation.machine import Machine

    settings.check()
    tasks = [find_task(name, options) for name in scenes]
    machine, done, interrupted = Machine.here(), [], False
    for task in tasks:
        try:
            done.append(_one(task, settings, accuracy))
            echo(scene_text(done[-1]))
        except (KeyboardInterrupt, SimulationInterrupted):
            interrupted = True
        if interrupted or done[-1].interrupted:
            break
    echo(str(machine))
    if done:
        command = command_text(scenes, options, settings, accuracy)
        report = BenchmarkReport(machine, command, done)
        with written_files() as written:
            for path, write in zip(files, (write_report, write_plot), strict=True):
                if path is not None:
                    written(partial(write, report, path))
    if interrupted or done[-1].interrupted:
        raise SimulationInterrupted("interrupted; what was measured before is above", None)
    missed = [f"{scene.task.name}: {row_name(row)}" for scene in done for row in scene.missed]
    if missed:
        fail(f"{len(missed)} rows missed the accuracy requested: {'; '.join(missed)}", MISSED)


def _one(task: Task, settings: ComparisonSettings, accuracy: float | None) -> Comparison:
    """Measure one scene, or find the advice for it."""
    from hexapod_pin.benchmark.advice import advice_comparison
    from hexapod_pin.benchmark.work_precision.comparison import compare

    if accuracy is not None:
        announce(f"looking for the cheapest settings on {task.name}")
        return advice_comparison(task, accuracy)
    with progress_bar(f"measuring {task.name}") as progress:
        return compare(task, settings, progress)


def _report_files(out: Path | None, plot: Path | None) -> tuple[Path | None, Path | None]:
    """Return the files to write, refused now rather than after the measurement."""
    from hexapod_pin.benchmark.report import WRITERS

    return (
        None if out is None else writable("--out", out, tuple(WRITERS)),
        None if plot is None else writable_figure("--plot", plot),
    )


def _hard(quick: bool, out: Path | None) -> None:
    """Run the suite, print its tables and write them to `out` (.md); fail where a row missed."""
    from hexapod_pin.benchmark.hard_suite import suite_page, suite_parts
    from hexapod_pin.validation.machine import Machine

    if out is not None:
        out = writable("--out", out, (".md",))
    machine, parts = Machine.here(), []
    echo(str(machine))
    stopped: BaseException | None = None
    try:
        for title, run in suite_parts(quick):
            with progress_bar(title) as tick:
                parts.append(run(tick))
            echo(f"\n{parts[-1].table.text()}\n{parts[-1].summary}")
            if parts[-1].interrupted is not None:
                raise parts[-1].interrupted
    except (KeyboardInterrupt, SimulationInterrupted) as error:
        stopped = error
    if out is not None and parts:
        write_atomically(out, suite_page(machine, parts))
        echo(f"wrote {out}")
    if stopped is not None:
        text = f"interrupted; {len(parts)} of the suite's parts were begun and are above"
        raise SimulationInterrupted(text, None) from stopped
    if any(part.failed for part in parts):
        missed = "; ".join(f"{one.table.title}: {one.summary}" for one in parts if one.failed)
        fail(f"rows of the tables missed. {missed}", MISSED)


# `hexapod-pin verify`: compare the formulations with each other and with closed forms.


def verify(
    everything: Annotated[
        bool, typer.Option("--all", help="MuJoCo, where installed, and the hard cases too.")
    ] = False,
    only: Annotated[
        OptionalText,
        typer.Option(help="Names of checks, separated by commas; default: every check."),
    ] = None,
    out: Annotated[
        OptionalPath,
        typer.Option(help="Markdown file to write the table to."),
    ] = None,
) -> None:
    """Compare the formulations with each other and with closed forms.

    Exit status 0: every row that ran met its number or is an expected failure; 1: one did not.
    """
    from hexapod_pin.validation.checks.registry import run_checks
    from hexapod_pin.validation.tables import failures_text, result_table, summary

    path = None if out is None else writable("--out", out)
    names = None if only is None else [name.strip() for name in only.split(",")]
    stopped = None
    try:
        with progress_bar("verifying") as progress:
            results = run_checks(names=names, everything=everything, progress=progress)
    except SimulationInterrupted as error:
        results, stopped = list(error.results or ()), error
    table, text = result_table(results), summary(results)
    text += "" if stopped is None else f"\n{stopped}"
    echo(f"{text.strip()}\n\n{table.text()}")
    if path is not None:
        write_atomically(path, f"{table.markdown()}\n{text}\n")
        echo(f"wrote {path}")
    if stopped is not None:
        raise stopped
    if any(result.failed for result in results):
        fail(failures_text(results), MISSED)
