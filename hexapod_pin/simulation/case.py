"""A case is one run as data: scene, controller and settings.

`simulate` makes a case of its arguments and runs it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.control.kinematic import planning_progress
from hexapod_pin.errors import SimulationInterrupted
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.accuracy_control import ControlledRun, Runs, controlled_runs
from hexapod_pin.simulation.case_data import CaseData, case_from_dict, case_to_dict, read_case
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.open_loop import open_loop_run
from hexapod_pin.simulation.run_settings import RunSettings, WorkLimits, chosen_limits
from hexapod_pin.simulation.session import controlled_loop, lock_step_runs
from hexapod_pin.simulation.steady_walk import steady_runs
from hexapod_pin.user_code import user_callback
from hexapod_pin.user_file import read_text, user_path

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene


@checked(but="record")
@dataclass(frozen=True, eq=False)
class Case(CaseData):
    """One run as data. Two cases are equal when they mean the same run.

    Attributes:
        scene: robot, ground, contact, servos, loads.
        controller: as of `simulate`.
        initial: state at the start, or a checkpoint to continue from; None: standing.
        duration: simulated time [s]; None where `simulate_batch` gives one for all.
        until: as of `simulate`.
        accuracy, torque_accuracy, estimate, method, step, sample: as of `simulate`.
        record: as of `simulate`, stored as a tuple; None where everything is recorded.
        limits: as of `simulate`; no part of what the case means, and of no file.

    Raises:
        ParameterError: a setting is out of range, or they do not fit together.

    Example:
        >>> case = Case(Scene(load_robot("athena")), HoldPosture(), duration=2.0)
        >>> case.save("case.toml")
        >>> load_case("case.toml") == case
        True
    """

    def run(self, progress: Callable[[float], None] | None = None) -> Trace:
        """Run the case; returns and raises as `simulate`."""
        return run_case(self, user_callback("progress", progress))

    def to_toml(self) -> str:
        """Return the case as TOML text; numbers keep every bit.

        Raises:
            ParameterError: the controller cannot be written: no `to_dict`, or not registered.
        """
        import tomli_w

        return tomli_w.dumps(case_to_dict(self))

    @classmethod
    @checked
    def from_toml(cls, text: str, folder: str | Path | None = None) -> Case:
        """Rebuild a case from its text; the robot is loaded again.

        Args:
            text: what `to_toml` gave, or what was written like it.
            folder: where a relative path of a robot's file starts, if not here.

        Raises:
            ParameterError: bad TOML, an unknown or missing key, a value out of range, each with
                its path; or a robot file that has changed since.
            UrdfError, UnknownNameError: the robot, or something in it, is not there.
        """
        return read_case(cls, text, folder)

    def save(self, path: str | Path) -> Path:
        """Write the case to a TOML file, wholly or not at all, and return its path.

        A robot's file in the same folder or below is named relative to it, so that both can move
        together; any other by its absolute path.

        Raises:
            ParameterError: the controller cannot be written.
            TraceFileError: the file cannot be written.
        """
        import tomli_w

        text = tomli_w.dumps(case_to_dict(self, user_path(path).absolute().parent))
        return write_atomically(path, text.encode())


@checked
def load_case(path: str | Path | Trace | Summary) -> Case:
    """Read a case that `Case.save` wrote, or a text written like it; or build that of a trace.

    Running the case of a trace again repeats its samples to the bit.

    Args:
        path: of the file; or a trace, or a summary, whose case is wanted.

    Raises:
        ParameterError: no such file, or as `Case.from_toml`; or the trace is that of a session.
        UrdfError, UnknownNameError: the robot, or something in it, is not there.
    """
    if isinstance(path, Trace | Summary):
        return case_from_dict(Case, path.run.case_data)
    text = read_text(path, "case file")
    return Case.from_toml(text, user_path(path).absolute().parent)


# `simulate`: run one scene under one controller.


@checked(but="record")
def simulate(
    scene: Scene,
    controller: Controller | FeedbackController,
    *,
    duration: float,
    until: str | None = None,
    accuracy: float | None = None,
    torque_accuracy: float | str | None = None,
    estimate: bool | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    record: Sequence[str] | None = None,
    initial: State | Checkpoint | None = None,
    limits: WorkLimits | None = None,
    allow: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Trace:
    """Run a scene under a controller.

    Args:
        scene: robot, ground, contact, servos.
        controller: gives the joint set-points: all of them before the run (`KinematicControl`,
            `HoldPosture`), or at its ticks from what it measures (a `FeedbackController`).
        duration: simulated time [s]; 0 returns the initial sample.
        until: "steady": the walk begins in motion and is run until a cycle repeats, which is the
            result; what is left of the transients is part of its error. Where none of ten cycles
            repeats, the usual run of `duration` is. The ground must be a plane, the gait periodic
            (`KinematicControl` without stop or commands), its cycle a whole number of samples.
        accuracy: largest error in positions at the sampled times [m and rad]; default 1e-4. A run
            that knows its own error is enough; otherwise the case is run at two resolutions or more
            until its estimated error is within the accuracy. Where that is impossible,
            `trace.accuracy_kept` is False and `trace.predictable_until` is the last time within it.
        torque_accuracy: largest error in torques at the sampled times [N m], or as a share of the
            largest torque, such as "1 %"; instead of `accuracy`, or in addition. Where neither is
            given, both are in force: 1e-4 and "1 %" (1e-4 alone with "extrapolated-euler").
        estimate: False: a single run, each of whose steps meets the accuracy; the error of the
            whole run is unknown. None: True, except for a `FeedbackController`: with True it is
            called in every run and must be pure.
        method: adaptive "ndf" (the default of planned runs that can know their own error; see
            docs/accuracy.md), "extrapolated-euler" (the default of all others), "dop853" (explicit,
            for references); or with fixed steps "robust", "implicit-euler" (the default where a
            step is given), "rk4".
        step: integration step of a fixed-step method [s]; default 1 ms.
        sample: time between samples [s]. Adaptive: default 2 ms, and the last sample is at the
            end, sooner where the times do not divide. Fixed steps: a whole number of
            steps, default 1 ms or one step.
        record: groups of samples to keep: "torque", "set_points", "contacts" (feet: place, force,
            gap, normal), "com", "energy"; "motion" (time, q, v) always is. None: all of these.
            Only where they are named: "sliding" (speed of the contact points along the ground),
            "current" and "temperature" (of motors whose constants are known). Summary and torque
            budget need none of them.
        initial: state at t = 0; default standing at the controller's first set-point. Or a
            `Checkpoint` (`trace.checkpoint`) to continue from, at its own time.
        limits: largest memory, steps, evaluations and wall time of the run; None: the defaults.
        allow: True lifts all limits where `limits` is None.
        progress: called with the finished fraction (0..1) from time to time.

    Returns:
        The trace, with the first sample at the start.

    Raises:
        ParameterError: a setting out of range, or a method that cannot do this scene, or a run
            that would need more than its limits.
        GaitError, ReachError: the controller cannot do this on this robot.
        StateError: `initial` does not fit the robot.
        DivergenceError: the state is no longer finite; `.trace` holds the samples before.
        WorkLimitError: the run reached a limit; `.trace` holds its samples.
        SimulationInterrupted: Ctrl-C; `.trace` holds the samples so far, None while planning.
        UserCodeError: the controller or `progress` has raised.
        HexapodError: any other error of the run; `.trace` holds the samples after its first step.
    """
    case = Case(
        scene, controller, initial,
        duration=duration, until=until, accuracy=accuracy, torque_accuracy=torque_accuracy,
        estimate=estimate, method=method, step=step, sample=sample, record=record,
        limits=chosen_limits(limits, allow),
    )  # fmt: skip
    return run_case(case, user_callback("progress", progress))


def run_case(
    case: Case,
    progress: Callable[[float], None] | None = None,
    planning: Callable[[float], None] | None = None,
) -> Trace:
    """Run a case; returns and raises as `simulate`.

    `planning` is called with the finished fraction of what is planned before the run.
    """
    try:
        with planning_progress(planning):
            if isinstance(case.controller, FeedbackController):
                if case.settings.estimate:
                    return controlled_loop(case, progress).trace()
                run = lock_step_runs([case], case.settings, progress=progress)[0]
                return run.require_good()
            if case.until is not None:
                return _one_by_one(case_runs(case), progress)
            run = open_loop_run(case, case.settings, in_parts=True)
    except KeyboardInterrupt:
        text = "interrupted while the run was being planned; nothing was simulated"
        raise SimulationInterrupted(text, None) from None
    return _open_loop(run, progress)


def case_runs(case: CaseData, *, record: bool = True) -> Runs[Trace | Summary]:
    """Yield the runs of a case without feedback, and return its result; see `Runs`.

    Args:
        case: what is run.
        record: whether the result is a trace, or the summary alone.

    Raises:
        HexapodError: as `simulate`.
    """
    control = None
    if case.until is not None:
        control = yield from steady_runs(case, record=record)
    if control is None:
        settings = case.settings
        run = open_loop_run(case, settings.at_first_level(), record=record)
        if not settings.estimate:
            yield run
            if record:
                return run.require_good()
            run.require_good_so_far()
            return run.summary()
        control = yield from controlled_runs(run)
    return control.trace() if record else control.summary()


def _one_by_one(runs: Runs[Trace | Summary], progress: Callable[[float], None] | None) -> Trace:
    """Advance runs, each after the other; their number is not known before."""
    left = 1.0

    def tell(fraction: float) -> None:
        if progress is not None:
            progress(1.0 - left + left * SHARE_OF_A_RUN * fraction)

    try:
        while True:
            next(runs).advance(tell)
            left *= 1.0 - SHARE_OF_A_RUN
    except StopIteration as end:
        if progress is not None:
            progress(1.0)
        return cast("Trace", end.value)


SHARE_OF_A_RUN = 0.3
"""Of the progress not shown yet, that a run takes whose successors are not known [-]."""


def _open_loop(run: NativeRun, progress: Callable[[float], None] | None) -> Trace:
    """Run what has been planned."""
    if not run.settings.estimate:
        run.advance(progress)
        return run.require_good()

    def runner(settings: RunSettings, report: Callable[[float], None] | None) -> NativeRun:
        other = run.with_settings(settings)
        other.advance(report)
        return other

    return ControlledRun(run.settings, runner, progress).outcome().trace()
