"""Run a case, print what came of it, and leave its files: what `walk` and `run` share."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.commands.options import Shown
from hexapod_pin.commands.terminal import echo, typed_command
from hexapod_pin.commands.trials import try_cure, try_repaired
from hexapod_pin.results.run_facts import events_text
from hexapod_pin.text_table import WIDTH, folded

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.results.peak_verdict import PeakVerdicts
    from hexapod_pin.results.torque_budget import TorqueBudget
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.results.walk_answer import WalkAnswer
    from hexapod_pin.simulation.case import Case


@dataclass(frozen=True)
class CaseToReport:
    """A case, and what is known of it besides.

    Attributes:
        case: to run.
        title: of its progress bar.
        about: lines on robot, gait and motor, for `--full`.
        remarks: what else to know of them, a few words each.
        assumed: what is assumed besides what the run knows.
        motor: the motor of all joints, of the catalogue.
        repaired: makes the case with the robot's file repaired, where the file is doubtful.
        changed: makes the case with another value of a field of its gait.
        following: command for the next step.
        caution: what the first line must have, in a few words; empty where nothing.
    """

    case: Case
    title: str
    about: Sequence[str] = ()
    remarks: Sequence[str] = ()
    assumed: Sequence[str] = ()
    motor: MotorRecord | None = None
    repaired: Callable[[], Case] | None = None
    changed: Callable[[str, float], Case] | None = None
    following: str = ""
    caution: str = ""


def run_and_report(
    job: CaseToReport, trace_path: Path, html_path: Path | None, shown: Shown
) -> None:
    """Run a case with a progress bar; print the answer; write files.

    Where servo gains are assumed and the robot walks, run twice more to show what peaks owe to
    them; where the robot's file is doubtful, once more with it repaired. With `shown.verdict`
    compute its peaks again, once all files are written.
    Where the robot does not walk, its torques are doubtful, or its motor fails, exit with
    DOES_NOT_WALK.
    """
    from hexapod_pin.commands.output_files import (
        least_sizes,
        require_room,
        run_saving,
        written_files,
    )
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.results.walk_answer import walk_answer
    from hexapod_pin.simulation.case import run_case

    case = job.case
    require_room(least_sizes(case, trace_path, html_path))
    with progress_bar(job.title) as progress:
        planning = progress.stage("planning the walk")
        trace, refusal = run_saving(lambda: run_case(case, progress, planning), trace_path)
    caution = ", ".join(filter(None, (case.scene.robot.caution, job.caution)))
    answer = replace(walk_answer(trace, job.motor), caution=caution)
    more = list(job.remarks)
    if case.scene.robot.doubts and job.repaired is not None and not shown.quick:
        trial = try_repaired(answer, job.repaired)
        answer, more = trial.judged(answer), [*more, trial.line]
    if not answer.verdict.walks and job.changed is not None and not shown.quick:
        more.append(try_cure(answer.verdict, job.changed))
    if not shown.json:
        echo("\n".join(answer.lines()))
    with written_files(quiet=True) as files:
        files.note(trace_path, refusal)
        if html_path is not None:
            from hexapod_pin.view.html import write_html

            files(lambda: write_html(trace, html_path, motor=job.motor, command=typed_command()))
        assumed = case.scene.servos.assumed and not case.scene.prescribed
        whole = answer.budget is not None
        if whole and answer.verdict.walks and not shown.quick and assumed:
            more.append(_stiffness_line(case, trace, shown.threads))
        judged = verdict_on_peaks(trace, shown.threads) if shown.verdict and whole else None
        if shown.json:
            _print_json(answer, more, judged, files.written)
        else:
            _print_rest(job, trace, answer, more, judged, files.written, shown)
    exit_by(answer)


def exit_by(answer: WalkAnswer) -> None:
    """Exit with DOES_NOT_WALK where an answer is not good; its first line goes to stderr, too."""
    from hexapod_pin.commands.terminal import DOES_NOT_WALK, fail

    if answer.good:
        return
    advice = answer.verdict.advice
    more = f" {advice[:1].upper()}{advice[1:]}." if advice else ""
    fail(f"{answer.headline}.{more}", DOES_NOT_WALK)


def _print_json(
    answer: WalkAnswer, more: Sequence[str], judged: PeakVerdicts | None, written: Sequence[Path]
) -> None:
    """Print everything as JSON."""
    import json

    data = {**answer.to_dict(), "notes": list(more), "files": list(map(str, written))}
    if judged is not None:
        data["peaks"] = judged.to_dict()
    echo(json.dumps(data, indent=2, allow_nan=False))


def print_doubts(
    trace: Trace, more: Sequence[str], shown: Shown, assumed: Sequence[str] = ()
) -> None:
    """Print on what the numbers rest: the run's error where it is too large, what is assumed."""
    count = len(trace.run.assumed) + len(assumed)
    if trace.error is not None and not trace.accuracy_kept:
        more = [*more, f"positions may be off by {trace.error_estimate:.1e} m or rad: NOT the "
                       f"{trace.run.numerics.accuracy:g} requested"]  # fmt: skip
    if count and not shown.full:
        more = [*more, f"{count} assumed (--assumed)"]
    for line in folded("; ".join(filter(None, more))):
        echo(line)


def _print_rest(
    job: CaseToReport, trace: Trace, answer: WalkAnswer, more: Sequence[str],
    judged: PeakVerdicts | None, written: Sequence[Path], shown: Shown,
) -> None:  # fmt: skip
    """Print what follows the answer: doubts, files, the next command, and what was asked for."""
    print_doubts(trace, more, shown, job.assumed)
    names = ", ".join(map(near, written))
    following = f"next: {job.following}" if job.following and answer.good else ""
    line = f"wrote {names}" if written else ""
    apart = len(line) + len(following) + 3 > WIDTH
    for text in (line, following) if apart else (f"{line}   {following}".strip(),):
        if text:
            echo(text)
    if shown.full:
        assumed = [f"assumed: {text}" for text in job.assumed]
        echo("\n" + "\n".join([*job.about, *assumed, answer.verdict.line, run_summary(trace)]))
        if job.case.until is not None:
            echo(_steadiness(job.case, trace))
        for note in events_text(trace.events, trace.limits):
            echo(f"note: {note}")
        if answer.budget is not None:
            echo("\n" + answer.budget.table())
    else:
        print_parts(trace, answer.budget, shown, job.assumed)
    if judged is not None:
        echo("\n" + judged.table())


def print_parts(
    trace: Trace, budget: TorqueBudget | None, shown: Shown, assumed: Sequence[str] = ()
) -> None:
    """Print the joints and assumptions that were asked for."""
    from hexapod_pin.results.joint_budget import joint_lines

    if shown.joints and budget is not None:
        per = "window" if budget.window.cycles is None else "cycle"
        echo("\n" + "\n".join(joint_lines(budget.joints, per)))
    if shown.assumed:
        echo("\n" + "\n".join(f"assumed: {text}" for text in (*trace.run.assumed, *assumed)))


def near(path: Path) -> str:
    """Return a path from the present folder, where it is in it."""
    try:
        return str(path.relative_to(Path.cwd()))
    except (ValueError, OSError):
        return str(path)


def length_of(case: Case) -> str:
    """Return how long a case runs, in words."""
    if case.until is not None:
        return "until a cycle repeats"
    return f"{case.settings.duration:g} s"


OF_ANY_WALK = {
    "--repair", "--out", "--html", "--no-html", "--save-case", "--quick", "--threads", "--json",
    "--full", "--joints", "--assumed", "--verdict", "--accuracy", "--torque-accuracy", "--sample",
    "--record", "--force", "--motor", "--voltage", "--catalog",
}  # fmt: skip
"""Options of `walk` with which its robot and its task are those that `select` takes of itself."""


def following_command(robot: str, trace: Path, *, repair: bool) -> str:
    """Return the command that ranks motors for the robot, or for a walk that `select` has not."""
    typed = shlex.split(typed_command())
    options = {text.partition("=")[0] for text in typed if text.startswith("-")}
    if options <= OF_ANY_WALK:
        return shlex.join(["hexapod-pin", "select", robot, *["--repair"] * repair])
    return shlex.join(["hexapod-pin", "budget", near(trace), "--catalog"])


def _stiffness_line(case: Case, trace: Trace, threads: int) -> str:
    """Return how far the peak torque depends on assumed servo gains, with a progress bar."""
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.study.judge_peaks import servo_stiffness

    with progress_bar("softer and stiffer servos") as progress:
        effect = servo_stiffness(case, trace, threads=threads, progress=progress)
    return effect.line


def verdict_on_peaks(trace: Trace, threads: int) -> PeakVerdicts:
    """Compute the peaks of a trace again, with a progress bar, and return which hold."""
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.study.judge_peaks import judge_peaks

    with progress_bar("computing peaks again") as progress:
        return judge_peaks(trace, threads=threads, progress=progress)


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
