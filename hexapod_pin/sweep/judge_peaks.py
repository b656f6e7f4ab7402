"""Peaks of a torque budget with a verdict: which hold when the run is computed again."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from hexapod_pin.errors import DivergenceError, HexapodError, ParameterError, SimulationInterrupted
from hexapod_pin.results.peak_judgement import judge_summaries
from hexapod_pin.results.peak_verdict import PeakVerdicts
from hexapod_pin.results.recomputation import RUN, Recomputation
from hexapod_pin.results.steady_window import summary_window
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.batch import simulate_batch
from hexapod_pin.simulation.case import Case
from hexapod_pin.sweep.peak_variants import cuts_torque, peak_variants

GIVEN_START = (
    "The run starts from a given state: with another stiffness the robot is not at rest there, "
    "which counts where the window begins with the run."
)


def judge_peaks(
    run: Case | Trace,
    *,
    threads: int = 1,
    progress: Callable[[float], None] | None = None,
) -> PeakVerdicts:
    """Compute the peak torques of a run again and return which of them hold.

    The run is repeated at ten times the accuracy (fixed steps: a tenth of the step), and from there
    with doubled contact stiffness and with doubled servo stiffness; see `Contact.stiffer` and
    `Servo.stiffer` for what that means. A peak that moves by no more than 5 % under each change
    holds; any other is a range, with what moved it. A change under which the run fails makes the
    range unknown.

    Args:
        run: a case, or the trace of one: then the run itself is not repeated.
        threads: as in `simulate_batch`.
        progress: called with the finished fraction (0..1) as runs finish.

    Raises:
        ParameterError: no case, a case without duration, a trace that ends before its case does,
            or no whole cycle of steady walking; says how long to simulate.
        UrdfError: the robot's file of a trace is no longer usable.
        DivergenceError: the run itself diverges; or whatever else it is refused with.
        SimulationInterrupted: Ctrl-C; `.results` holds what was done.

    Example:
        >>> print(judge_peaks(trace).table())
    """
    case, summaries = _case_of(run)
    variants = peak_variants(case)
    planned = [(change.name, variant) for change, variant in variants if variant is not None]
    if RUN not in summaries:
        planned.insert(0, (RUN, case))
    results = _run_all([variant for _, variant in planned], threads, progress)
    failures: dict[str, str] = {}
    for (name, _), result in zip(planned, results, strict=True):
        if isinstance(result, Summary) and (name == RUN or _has_window(result)):
            summaries[name] = result
        elif name == RUN:
            raise result
        else:
            failures[name] = _failure(result)
    changes = [_with_failure(change, failures) for change, _ in variants]
    notes = () if case.initial is None else (GIVEN_START,)
    return judge_summaries(summaries, changes, limited=cuts_torque(case.scene), notes=notes)


def _case_of(run: Case | Trace) -> tuple[Case, dict[str, Summary]]:
    """Return what is to be run, and the summary of the run itself where there is one."""
    if isinstance(run, Case):
        return run, {}
    if not isinstance(run, Trace):
        raise ParameterError("run", type(run).__name__, "a Case or the Trace of one")
    case: Case = run.case
    done = float(run.time[-1] - run.time[0])
    duration = case.settings.duration
    if not math.isclose(done, duration, rel_tol=1e-6):
        hint = "It was interrupted or diverged: simulate a shorter case."
        raise ParameterError("trace", done, f"of a run that reached its {duration:g} s", hint)
    if not run.has_summary:
        return case, {}
    summary_window(run.summary)
    return case, {RUN: run.summary}


def _run_all(
    cases: list[Case], threads: int, progress: Callable[[float], None] | None
) -> list[Any]:
    try:
        return list(simulate_batch(cases, threads=threads, keep="summary", progress=progress))
    except SimulationInterrupted as error:
        text = f"no verdict on the peaks: {error}"
        raise SimulationInterrupted(text, None, error.results) from None


def _has_window(summary: Summary) -> bool:
    try:
        summary_window(summary)
    except ParameterError:
        return False
    return True


def _failure(result: object) -> str:
    """Return in words why a run has no peaks."""
    if isinstance(result, DivergenceError):
        return "diverged"
    if isinstance(result, HexapodError):
        return f"was refused: {result}"
    if isinstance(result, Exception):
        return f"failed: {type(result).__name__}: {result}"
    return "left no whole cycle"


def _with_failure(change: Recomputation, failures: dict[str, str]) -> Recomputation:
    failure = failures.get(change.name)
    return change if failure is None else replace(change, failure=failure)
