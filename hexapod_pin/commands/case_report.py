"""Run a case, print what came of it, and leave its files: what `walk` and `run` share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.commands.terminal import echo
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.results.peak_verdict import PeakVerdicts
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.simulation.case import Case


def run_and_report(
    case: Case,
    title: str,
    trace_path: Path,
    html_path: Path | None,
    *,
    verdict: bool = False,
    quick: bool = False,
    threads: int = 1,
) -> None:
    """Run a case with a progress bar; print the verdict on it and its torque table; write files.

    Where servo gains are assumed and the robot walks, run twice more to show what peaks owe to
    them, unless `quick`. With `verdict` compute its peaks again, once all files are written. Both
    so many runs at a time.
    Where the robot does not walk, exit with DOES_NOT_WALK: the reason, and what to change.
    """
    from hexapod_pin.commands.output_files import (
        least_sizes,
        require_room,
        run_saving,
        written_files,
    )
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.commands.terminal import DOES_NOT_WALK, fail
    from hexapod_pin.results.run_facts import events_text
    from hexapod_pin.results.walk_verdict import walk_verdict
    from hexapod_pin.simulation.case import run_case

    require_room(least_sizes(case, trace_path, html_path))
    with progress_bar(title) as progress:
        planning = progress.stage("planning the walk")
        trace, refusal = run_saving(lambda: run_case(case, progress, planning), trace_path)
    walk = walk_verdict(trace)
    echo(f"{walk.line}\n{run_summary(trace)}")
    if case.until is not None:
        echo(_steadiness(case, trace))
    for line in events_text(trace.events, trace.limits):
        echo(f"note: {line}")
    with written_files() as files:
        whole = _print_budget(trace)
        files.note(trace_path, refusal)
        if html_path is not None:
            from hexapod_pin.view.html import write_html

            files(lambda: write_html(trace, html_path))
        assumed = case.scene.servos.assumed and not case.scene.prescribed
        if whole and walk.walks and not quick and assumed:
            echo(_stiffness_line(case, trace, threads) + "\n")
    if verdict and whole:
        echo("\n" + verdict_on_peaks(trace, threads).table())
    if not walk.walks:
        advice = f"{walk.advice[:1].upper()}{walk.advice[1:]}"
        fail(f"{walk.robot_name} does not walk: {walk.reason}. {advice}.", DOES_NOT_WALK)


def length_of(case: Case) -> str:
    """Return how long a case runs, in words."""
    if case.until is not None:
        return "until a cycle repeats"
    return f"{case.settings.duration:g} s"


def _stiffness_line(case: Case, trace: Trace, threads: int) -> str:
    """Return how far the peak torque depends on assumed servo gains, with a progress bar."""
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.study.judge_peaks import servo_stiffness

    with progress_bar("softer and stiffer servos") as progress:
        return servo_stiffness(case, trace, threads=threads, progress=progress).line


def verdict_on_peaks(trace: Trace, threads: int) -> PeakVerdicts:
    """Compute the peaks of a trace again, with a progress bar, and return which hold."""
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.study.judge_peaks import judge_peaks

    with progress_bar("computing peaks again") as progress:
        return judge_peaks(trace, threads=threads, progress=progress)


def _print_budget(trace: Trace) -> bool:
    """Print the torque table, or why a walk this short has none; return whether it has one."""
    from hexapod_pin.results.torque_budget import torque_budget

    try:
        echo("\n" + torque_budget(trace).table() + "\n")
    except ParameterError as error:
        echo(f"no torque table: {error}", err=True)
        return False
    return True


def _steadiness(case: Case, trace: Trace) -> str:
    """Return one line: how nearly the cycle reported repeats, or that none does."""
    numerics = trace.run.numerics
    if numerics.cycles_run is None:
        return f"note: no cycle was found that repeats; the walk was run for {case.duration:g} s"
    return (
        f"steady: cycle {numerics.cycles_run} after the start in motion repeats to "
        f"{numerics.transients:.1e} m or rad and {numerics.torque_transients:.1e} N m, "
        "which the errors include; a start from standing (--duration) is not in it"
    )


def run_summary(trace: Trace) -> str:
    """Return one line: how the run was integrated, what it cost, its own error."""
    numerics, counters = trace.run.numerics, trace.counters
    how = f"accuracy {numerics.accuracy:g}" if numerics.accuracy else f"step {numerics.step:g} s"
    energy = "energy not recorded"
    if "energy" in trace.recorded:
        worked = float(abs(trace.energy["servo_work"]).max())
        residual = float(abs(trace.energy_residual).max())
        energy = f"energy residual {residual:.1e} J of {worked:.3g} J of servo work"
    return (
        f"method {numerics.method}, {how}: {counters['steps']} steps, "
        f"{counters['evaluations']} evaluations, {trace.run.wall_time:.2g} s; "
        f"{_error_words(trace)}{energy}"
    )


def _error_words(trace: Trace) -> str:
    """Return what is known of the run's own error."""
    if not trace.run.numerics.accuracy:
        return ""
    if trace.error is None:
        return f"largest error of a step {trace.step_error:.1e} m or rad, "
    error = f"error of positions at most {trace.error_estimate:.1e} m or rad"
    if trace.error.torque is not None:
        error += f", of torques {trace.error.torque[-1]:.1e} N m"
    count = trace.counters["runs"]
    runs = f"by {count} runs" if count > 1 else "carried along by the run"
    if trace.accuracy_kept:
        return f"{error} ({runs}), "
    until = trace.predictable_until
    from_when = "" if until == float("inf") else f" after t = {until:g} s"
    return f"{error} ({runs}): NOT the accuracy requested{from_when}, "
