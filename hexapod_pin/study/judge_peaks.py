"""Peaks of a torque budget are recomputed in other cases, also with other servo stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import DivergenceError, HexapodError, ParameterError
from hexapod_pin.results.peak_judgement import judge_summaries
from hexapod_pin.results.peak_verdict import (
    ACCURACY,
    CONTACT,
    RUN,
    SERVO,
    PeakVerdicts,
    Recomputation,
)
from hexapod_pin.results.steady_window import summary_window
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_verdict import LEAST_SHARE
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.case import Case, load_case
from hexapod_pin.simulation.methods import METHODS, MethodSettings
from hexapod_pin.study.runs.measure import SUMMARY
from hexapod_pin.study.runs.runner import Runner, RunOptions, run_study

if TYPE_CHECKING:
    from typing_extensions import Unpack

GIVEN_START = (
    "The run starts from a given state: with another stiffness the robot is not at rest there, "
    "which counts where the window begins with the run."
)


@checked
def judge_peaks(run: Case | Trace, **how: Unpack[RunOptions]) -> PeakVerdicts:
    """Compute the peak torques of a run again and return which of them hold.

    The run is repeated at ten times the accuracy (fixed steps: a tenth of the step), and from there
    with doubled contact stiffness and with doubled servo stiffness; see `Contact.stiffer` and
    `Servo.stiffer` for what that means. A peak that moves by no more than 5 % under each change
    holds; any other is a range, with what moved it. A change under which the run fails makes the
    range unknown.

    Args:
        run: a case, or the trace of one: then the run itself is not repeated.
        **how: store, threads, workers, progress: see `RunOptions`.

    Raises:
        ParameterError: no case, a case without duration, a trace that ends before its case does,
            or no whole cycle of steady walking; the message states how long to simulate.
        UrdfError: the robot's file of a trace is no longer usable.
        DivergenceError: the run itself diverges; or whatever else it is refused with.
        StudyInterrupted: Ctrl-C; `.result` holds the rows of what was done.
        HexapodError: as of `run_study`.

    Example:
        >>> print(judge_peaks(trace).table())
    """
    return run_study(judged, run, **how)


def judged(runner: Runner, run: Case | Trace) -> PeakVerdicts:
    """Compute the peak torques of a run again; the study behind `judge_peaks`."""
    case, summaries = _case_of(run)
    variants = peak_variants(case)
    planned = [(change.name, variant) for change, variant in variants if variant is not None]
    if RUN not in summaries:
        planned.insert(0, (RUN, case))
    rows = runner.rows([variant for _, variant in planned], SUMMARY)
    results = rows.require_complete("no verdict on the peaks")
    failures: dict[str, str] = {}
    for (name, _), result in zip(planned, results, strict=True):
        if isinstance(result, Summary) and (name == RUN or _has_window(result)):
            summaries[name] = result
        elif name == RUN and isinstance(result, Exception):
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
    case = load_case(run)
    done = float(run.time[-1] - run.time[0])
    steady = run.run.numerics.cycles_run is not None
    duration = (run.run.numerics.duration or done) if steady else case.settings.duration
    if not math.isclose(done, duration, rel_tol=1e-6):
        hint = "It was interrupted or diverged: simulate a shorter case."
        raise ParameterError("trace", done, f"of a run that reached its {duration:g} s", hint)
    if not run.has_summary:
        return case, {}
    summary_window(run.summary)
    return case, {RUN: run.summary}


def _has_window(summary: Summary) -> bool:
    try:
        summary_window(summary)
    except ParameterError:
        return False
    return True


def _failure(result: object) -> str:
    """Return the reason why a run has no peaks."""
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


# The cases in which the peaks of a run are computed again.

FINER = 10
"""By which factor accuracy or step are finer."""

DENSER = 3
"""By which factor samples are denser where steps end at them: the errors of an adaptive run that
takes a step per sample are then at most a tenth (3^3 > 10, order 3), whatever its accuracy."""

STIFFER = 2.0
"""By which factor contact and servos are stiffer."""

TIGHT_METHOD = "ndf"
"""What computes accuracies that the run's own method does not reach."""

Variant = tuple[Recomputation, Case | None]
"""A change, and the case with it; None where it does not apply or cannot be had."""


def peak_variants(case: Case) -> tuple[Variant, Variant, Variant]:
    """Return the case at ten times the accuracy, and that with stiffer contact and servos.

    Stiffness is changed at ten times the accuracy too: errors of the run are then not taken for
    an effect of stiffness.

    Raises:
        ParameterError: the case has no duration.
    """
    finer = _finer(case)
    base, baseline = (case, RUN) if finer[1] is None else (finer[1], ACCURACY)
    at = _numerics(base.settings.method_settings)
    return finer, _stiffer_contact(base, baseline, at), _stiffer_servo(base, baseline, at)


def cuts_torque(scene: Scene) -> bool:
    """Return whether the drives cut torques at their limits."""
    servo = scene.servos
    return not scene.prescribed and (servo.limited or servo.motor is not None)


def with_servos(case: Case, factor: float) -> Case:
    """Return the case with servos of `factor` times the stiffness; see `Servo.stiffer`."""
    return replace(case, scene=replace(case.scene, servo=case.scene.servos.stiffer(factor)))


def _finer(case: Case) -> Variant:
    """Return the case at a tenth of its accuracy, or of its step.

    A tenth of the step for every method: behind a touch-down each is of first order only.
    """
    settings = case.settings
    choice, sample = settings.method_settings, settings.grid.sample
    own = case.until is not None and case.sample is None  # one that divides the cycle
    title = "ten times the accuracy"
    if not choice.method.adaptive:
        step = choice.step / FINER
        finer = replace(case, method=choice.method.name, step=step, sample=None if own else sample)
        text = f"step {choice.step / FINER:g} instead of {choice.step:g} s"
        return Recomputation(ACCURACY, title, text, RUN), finer
    tight = choice.resolved_accuracy / FINER
    method = choice.method
    if tight < method.tightest:
        method = METHODS[TIGHT_METHOD]
    text = f"accuracy {tight:g} instead of {choice.accuracy:g} m and rad"
    text += f", {method.name} instead of {choice.method.name}" * (method is not choice.method)
    denser = None if own else sample / DENSER
    change: dict[str, Any] = {"method": method.name, "accuracy": tight, "sample": denser}
    try:
        return Recomputation(ACCURACY, title, text, RUN), replace(case, **change)
    except ParameterError as error:
        failure = f"is out of reach: {error.name} must be {error.allowed}"
        return Recomputation(ACCURACY, title, text, RUN, failure=failure), None


def _numerics(method_settings: MethodSettings) -> str:
    return (
        f"accuracy {method_settings.accuracy:g}"
        if method_settings.method.adaptive
        else f"step {method_settings.step:g} s"
    )


def _stiffer_contact(case: Case, baseline: str, at: str) -> Variant:
    before = case.scene.contact
    after = before.stiffer(STIFFER)
    unit = f"N/m^{before.normal.exponent:g}"
    text = f"normal {after.normal.stiffness:.4g} instead of {before.normal.stiffness:.4g} {unit}"
    if before.friction.kind == "stick-slip" and after.friction.kind == "stick-slip":
        springs = (after.friction.stiffness, before.friction.stiffness)
        text += f", tangential {springs[0]:.4g} instead of {springs[1]:.4g} N/m"
    text += f", restitution and damping ratio kept; at {at}"
    changed = Recomputation(CONTACT, "doubled contact stiffness", text, baseline)
    return changed, replace(case, scene=replace(case.scene, contact=after))


def _stiffer_servo(case: Case, baseline: str, at: str) -> Variant:
    title, scene = "doubled servo stiffness", case.scene
    before = scene.servos
    if scene.prescribed:
        reason = "no servo: prescribed motion"
    elif not before.gains(scene.robot)[0].any():
        reason = "no servo stiffness: kp = 0"
    else:
        changed = with_servos(case, STIFFER)
        after = changed.scene.servos
        text = f"{after.describe()} instead of {before.describe()}, kd/kp kept; at {at}"
        return Recomputation(SERVO, title, text, baseline), changed
    return Recomputation(SERVO, title, "", baseline, unneeded=reason), None


# How far the peak torque of a run depends on the stiffness of its servos: two more runs.

FACTORS = (0.5, 2.0)
"""Stiffness over that of the run; kd / kp stays."""

WORDS = ("halved", "doubled")


@dataclass(frozen=True)
class StiffnessEffect:
    """Relative changes of a run's torques with servos of half and of twice the stiffness.

    Attributes:
        torque_peak_change: of the largest torque of any joint [-]; NaN where that run has none.
        torque_p99_change: of the largest torque not exceeded for 99 % of the time [-]; likewise.
        speed_share: speed over the nominal one in both runs [-]; NaN where none is planned.
        failures: why a run has no numbers, one for each; empty where it has.
    """

    torque_peak_change: tuple[float, float]
    torque_p99_change: tuple[float, float]
    speed_share: tuple[float, float]
    failures: tuple[str, str]

    @property
    def line(self) -> str:
        """The changes in one line."""
        text = f"peaks move by {_pair(self.torque_peak_change)} with servo stiffness x0.5/x2"
        for word, failure, speed in zip(WORDS, self.failures, self.speed_share, strict=True):
            if failure:
                text += f"; {word} it {failure}"
            elif speed < LEAST_SHARE:
                text += f"; {word} it makes {speed:.0%} of the nominal speed"
        return text


def servo_stiffness(case: Case, trace: Trace, **how: Unpack[RunOptions]) -> StiffnessEffect:
    """Run a case twice more, with half and with twice the servo stiffness.

    Args:
        case: what was run.
        trace: what came of it.
        **how: store, threads, workers, progress: see `RunOptions`.

    Raises:
        ParameterError: the run has no whole cycle, or no servo stiffness to change.
        StudyInterrupted: Ctrl-C.
        HexapodError: as of `run_study`.
    """
    return run_study(stiffness_effect, case, trace, **how)


def stiffness_effect(run: Runner, case: Case, trace: Trace) -> StiffnessEffect:
    """Run a case twice more; the study behind `servo_stiffness`."""
    base = trace.summary
    summary_window(base)
    if case.scene.prescribed or not case.scene.servos.gains(case.scene.robot)[0].any():
        raise ParameterError("case", "no servo stiffness", "one whose servos have a stiffness")
    rows = run.rows([with_servos(case, factor) for factor in FACTORS], SUMMARY)
    results = rows.require_complete("the stiffness of the servos was not varied")
    changes = [_changes(base, result) for result in results]
    peak, p99, speed, failures = zip(*changes, strict=True)
    return StiffnessEffect(peak, p99, speed, failures)


def _changes(base: Summary, result: object) -> tuple[float, float, float, str]:
    """Return relative change of peak and p99, speed over the nominal one, and a failure."""
    if not isinstance(result, Summary):
        return math.nan, math.nan, math.nan, f"ends early ({type(result).__name__})"
    nominal = result.run.walk.speed
    speed = (result.measured_speed or 0.0) / nominal if nominal and result.cycles else math.nan
    peak, p99 = (
        _largest(getattr(result, name)) / _largest(getattr(base, name)) - 1.0
        for name in ("torque_peak", "torque_p99")
    )
    return peak, p99, speed, ""


def _largest(values: Array) -> float:
    size = float(np.max(np.abs(values), initial=0.0))
    return size if size > 0.0 else math.nan


def _pair(values: tuple[float, float]) -> str:
    return "/".join("-" if math.isnan(value) else f"{value:+.0%}" for value in values)
